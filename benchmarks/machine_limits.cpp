#include "benchmarks/machine_limits.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstring>
#include <memory>
#include <thread>

#include "benchmarks/suites.h"
#include "gpu/host/host_launcher.h"
#include "harness/backends.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/device_limits.h"
#endif

namespace cutproof::cli {

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
  std::vector<double> seconds;
  for (int turn = 0; turn < repeats; ++turn) {
    const auto begin = Clock::now();
    on_all([&](std::size_t t) { std::memcpy(to[t].data(), from[t].data(), each); });
    seconds.push_back(seconds_since(begin));
  }
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

// A kernel that does next to nothing, on the host's threads; many in a row, because one is below the clock's
// resolution.
MachineLimit launch_on_host(int threads, int blocks, int repeats) {
  constexpr int kLaunches = 200;
  gpu::HostLauncher launcher(gpu::HostLauncher::Threads{threads});
  std::int64_t launches = 0;
  const auto launch_all = [&] {
    for (int k = 0; k < kLaunches; ++k) launcher.blocks(count_launch_kernel_object{}, blocks, 32, 0, &launches);
  };
  launch_all();
  std::vector<double> seconds;
  for (int turn = 0; turn < repeats; ++turn) {
    const auto begin = Clock::now();
    launch_all();
    seconds.push_back(seconds_since(begin) / kLaunches);
  }
  return {fmt::format("launch of {} {}", blocks, blocks == 1 ? "block" : "blocks"), times_of(std::move(seconds)), 0,
          int64_t{kLaunches} * (repeats + 1) - launches};
}

}  // namespace

MachineLimits measure_machine(const std::string& backend) {
  MachineLimits limits;
#if CUTPROOF_HAS_CUDA
  if (backend == "gpu") {
    const gpu::DeviceLimits measured = gpu::measure_device_limits();
    return {measured.copy_bytes_per_second, measured.graph_node_seconds, measured.chain_seconds};
  }
#endif
  const MachineLimit copy = copy_on_cpu(backend == "reference" ? 1 : cpu_threads(), kRepeats);
  limits.copy_bytes_per_second = copy.bytes / copy.seconds.median;
  return limits;
}

std::vector<MachineLimit> measure_machine_limits(const std::string& backend, int repeats) {
#if CUTPROOF_HAS_CUDA
  if (backend == "gpu") {
    const gpu::DeviceLimits measured = gpu::measure_device_limits(repeats);
    return {{"copy, device to device", times_of(measured.copy), measured.copy_bytes, measured.bytes_lost},
            {"graph of 40 empty kernels", times_of(measured.short_chain), 0, {}},
            {"graph of 400 empty kernels", times_of(measured.long_chain), 0, {}}};
  }
#endif
  std::vector<MachineLimit> limits = {copy_on_cpu(1, repeats)};
  if (backend == "host") {
    if (cpu_threads() > 1) limits.push_back(copy_on_cpu(cpu_threads(), repeats));
    for (const int blocks : {1, gpu::HostLauncher::kMostBlocks}) {
      limits.push_back(launch_on_host(cpu_threads(), blocks, repeats));
    }
  }
  return limits;
}

nlohmann::json to_json(const std::vector<MachineLimit>& limits) {
  nlohmann::json rows = nlohmann::json::array();
  for (const MachineLimit& limit : limits) {
    nlohmann::json row = {{"what", limit.what}, {"seconds", to_json(limit.seconds)}, {"lost", nullptr}};
    if (limit.bytes > 0) {
      row["bytes"] = limit.bytes;
      row["bytes_per_second"] = limit.bytes / limit.seconds.median;
    }
    if (limit.lost) row["lost"] = *limit.lost;
    rows.push_back(std::move(row));
  }
  return rows;
}

namespace {

struct Options {
  std::string backend = "reference", json;
  int repeats = 21;
};

int bench_machine_limits(const Options& options) {
  require_timed_backend(options.backend);
  require_writable(options.json);
  nlohmann::json document = begin_report("machine_limits", options.backend);
  const std::vector<MachineLimit> limits = measure_machine_limits(options.backend, options.repeats);
  Table table({"", "median µs", "least", "most", "GB/s", "lost"});
  for (const MachineLimit& limit : limits) {
    const auto microseconds = [](double seconds) { return fmt::format("{:.4g}", 1e6 * seconds); };
    table.add({limit.what, microseconds(limit.seconds.median), microseconds(limit.seconds.min),
               microseconds(limit.seconds.max),
               limit.bytes > 0 ? fmt::format("{:.4g}", 1e-9 * limit.bytes / limit.seconds.median) : "-",
               limit.lost ? fmt::format("{}", *limit.lost) : "-"});
  }
  fmt::print("\n{}", table.text());
  const bool holds =
      std::all_of(limits.begin(), limits.end(), [](const MachineLimit& limit) { return limit.lost.value_or(0) == 0; });
  if (!holds) fmt::print("FAILS: something that was timed did not do its work\n");
  document["repeats"] = options.repeats;
  document["rows"] = to_json(limits);
  document["holds"] = holds;
  document["complete"] = true;
  write_report(options.json, document);
  if (!options.json.empty()) fmt::print("\nwrote {}\n", options.json);
  return holds ? 0 : 1;
}

}  // namespace

Suite machine_limits_suite() {
  return {"machine_limits", "what the machine can do at best: copies, launches", [](CLI::App& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("--backend", options->backend, "whose machine: reference, host or gpu")
                ->capture_default_str()
                ->type_name("B");
            command.add_option("--repeats", options->repeats, "of each timing")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::Range(1, 10'000));
            command.add_option("--json", options->json, "write times")->type_name("F");
            return [options] { return bench_machine_limits(*options); };
          }};
}

}  // namespace cutproof::cli
