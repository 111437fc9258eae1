#include "benchmarks/machine_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "gpu/host/host_launcher.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/device_limits.h"
#endif

namespace cutproof::benchmarks {

namespace {

constexpr int kRepeats = 7;

// Copies with `threads` threads of the CPU between buffers beyond any cache.
MachineLimit copy_on_cpu(int threads, int repeats) {
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
  std::vector<double> seconds =
      seconds_of(repeats, [&] { on_all([&](std::size_t t) { std::memcpy(to[t].data(), from[t].data(), each); }); });
  int64_t lost = 0;
  for (const std::vector<char>& copy : to) lost += static_cast<int64_t>(each) - std::count(copy.begin(), copy.end(), 1);
  return {fmt::format("copy, {} {}", threads, threads == 1 ? "thread" : "threads"), times_of(std::move(seconds)),
          2.0 * static_cast<double>(each) * threads, lost};
}

template <class Block>
CUTPROOF_DEVICE void count_launch_kernel(Block& block, std::int64_t* launches) {
  if (block.first() == 0) ++*launches;
}
CUTPROOF_KERNEL(count_launch_kernel);

// A nearly empty kernel on the host's threads; many in a row, because one is below the clock's resolution.
MachineLimit launch_on_host(int threads, int blocks, int repeats) {
  constexpr int kLaunches = 200;
  gpu::HostLauncher launcher(gpu::HostLauncher::Threads{threads});
  std::int64_t launches = 0;
  const auto launch_all = [&] {
    for (int k = 0; k < kLaunches; ++k) launcher.blocks(count_launch_kernel_object{}, blocks, 32, 0, &launches);
  };
  launch_all();
  std::vector<double> seconds = seconds_of(repeats, launch_all);
  for (double& of_all : seconds) of_all /= kLaunches;
  return {fmt::format("launch of {} {}", blocks, blocks == 1 ? "block" : "blocks"), times_of(std::move(seconds)), 0,
          int64_t{kLaunches} * (repeats + 1) - launches};
}

}  // namespace

MachineLimits measure_machine(const harness::BackendDescriptor& backend) {
  using harness::Processor;
#if CUTPROOF_HAS_CUDA
  if (backend.processor == Processor::device) {
    const gpu::DeviceLimits measured = gpu::measure_device_limits();
    return {measured.copy_bytes_per_second, measured.graph_node_seconds, measured.chain_seconds,
            measured.l2_round_trip_seconds, measured.grid_sync_seconds};
  }
#endif
  const int threads = backend.processor == Processor::one_thread ? 1 : harness::cpu_threads();
  const MachineLimit copy = copy_on_cpu(threads, kRepeats);
  MachineLimits limits;
  limits.copy_bytes_per_second = copy.bytes / copy.seconds.median;
  return limits;
}

nlohmann::json to_json(const MachineLimits& machine) {
  nlohmann::json result = {{"copy_bytes_per_second", machine.copy_bytes_per_second}};
  if (machine.graph_node_seconds) {
    result["graph_node_seconds"] = *machine.graph_node_seconds;
    result["chain_of_40_seconds"] = *machine.chain_seconds;
    result["l2_round_trip_seconds"] = *machine.l2_round_trip_seconds;
    result["grid_sync_seconds"] = *machine.grid_sync_seconds;
  }
  return result;
}

std::vector<MachineLimit> measure_machine_limits(const harness::BackendDescriptor& backend, int repeats) {
  using harness::Processor;
#if CUTPROOF_HAS_CUDA
  if (backend.processor == Processor::device) {
    const gpu::DeviceLimits measured = gpu::measure_device_limits(repeats);
    return {{"copy, device to device", times_of(measured.copy), measured.copy_bytes, measured.bytes_lost},
            {"graph of 40 empty kernels", times_of(measured.short_chain), 0, {}},
            {"graph of 400 empty kernels", times_of(measured.long_chain), 0, {}},
            {"32768 dependent reads", times_of(measured.walk), 0, measured.walks_lost},
            {"100 meetings of the grid", times_of(measured.few_meetings), 0, measured.meetings_missed},
            {"1100 meetings of the grid", times_of(measured.many_meetings), 0, measured.meetings_missed}};
  }
#endif
  std::vector<MachineLimit> limits = {copy_on_cpu(1, repeats)};
  if (backend.processor == Processor::all_threads) {
    const int threads = harness::cpu_threads();
    if (threads > 1) limits.push_back(copy_on_cpu(threads, repeats));
    for (const int blocks : {1, gpu::HostLauncher::kMostBlocks}) {
      limits.push_back(launch_on_host(threads, blocks, repeats));
    }
  }
  return limits;
}

}  // namespace cutproof::benchmarks
