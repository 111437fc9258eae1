// The machine's limits, measured in the same run as the times that are multiples of them.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/times.h"
#include "harness/backends.h"

namespace cutproof::benchmarks {

struct MachineLimits {
  double copy_bytes_per_second = 0;                                // read + written
  std::optional<double> graph_node_seconds;                        // device only
  std::optional<double> chain_seconds;                             // of a graph of 40 empty kernels; device only
  std::optional<double> l2_round_trip_seconds, grid_sync_seconds;  // device only (device_limits.h)

  // Least time of a kernel that waits for the previous one and reads its results; 0 without a device.
  double phase_seconds() const { return graph_node_seconds.value_or(0) + l2_round_trip_seconds.value_or(0); }
};
// By the device, or by as many threads of the CPU as the backend uses.
MachineLimits measure_machine(const harness::BackendDescriptor& backend);
nlohmann::json to_json(const MachineLimits& machine);

// An operation whose time is a limit.
struct MachineLimit {
  std::string what;
  Times seconds;                // of one operation
  double bytes = 0;             // read + written; 0: none
  std::optional<int64_t> lost;  // wrong bytes, idle launches, wrong ends of walks, missed meetings; absent: no result
};
// One thread: a copy. All threads: copies by one and by all of them, launches of an empty kernel with one block and
// with the most blocks of a launch. A device: a copy, graphs that are chains of 40 and of 400 empty kernels, dependent
// reads, and kernels whose blocks meet 100 and 1100 times.
std::vector<MachineLimit> measure_machine_limits(const harness::BackendDescriptor& backend, int repeats);

}  // namespace cutproof::benchmarks
