#include "cli/bench/floors.h"

#include <cstring>
#include <thread>
#include <vector>

#include "cli/backends.h"
#include "cli/bench/report.h"
#if CUTPROOF_HAS_CUDA
#include "gpu/floors.h"
#endif

namespace cutproof::cli {

namespace {

// Copies with `threads` threads of the CPU between buffers beyond any cache.
double cpu_copy_bandwidth(int threads) {
  const std::size_t each = (std::size_t{256} << 20) / static_cast<std::size_t>(threads);
  std::vector<std::vector<char>> from(static_cast<std::size_t>(threads)), to(static_cast<std::size_t>(threads));
  const auto on_all = [&](auto work) {
    std::vector<std::thread> pool;
    for (std::size_t t = 0; t < from.size(); ++t) pool.emplace_back([&, t] { work(t); });
    for (std::thread& thread : pool) thread.join();
  };
  on_all([&](std::size_t t) {
    from[t].assign(each, 1);
    to[t].assign(each, 0);
  });
  std::vector<double> seconds;
  for (int turn = 0; turn < 7; ++turn) {
    const auto begin = Clock::now();
    on_all([&](std::size_t t) { std::memcpy(to[t].data(), from[t].data(), each); });
    seconds.push_back(seconds_since(begin));
  }
  return 2.0 * static_cast<double>(each) * threads / times_of(seconds).median;
}

}  // namespace

MachineFloors measure_machine(const std::string& backend) {
  MachineFloors floors;
#if CUTPROOF_HAS_CUDA
  if (backend == "gpu") {
    const gpu::Floors measured = gpu::measure_floors();
    return {measured.copy_bytes_per_second, measured.graph_node_seconds, measured.chain_seconds};
  }
#endif
  floors.copy_bytes_per_second = cpu_copy_bandwidth(backend == "reference" ? 1 : cpu_threads());
  return floors;
}

}  // namespace cutproof::cli
