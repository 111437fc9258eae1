// What the machine can do at best, measured in the same run as the times that are given as multiples of it.
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

  // What a kernel takes at least that waits for the one before it and reads what that has written; 0 without a device.
  double phase_seconds() const { return graph_node_seconds.value_or(0) + l2_round_trip_seconds.value_or(0); }
};
// By the device, or by as many threads of the CPU as the backend uses.
MachineLimits measure_machine(const harness::BackendDescriptor& backend);
nlohmann::json to_json(const MachineLimits& machine);

// One thing of which nothing can be faster.
struct MachineLimit {
  std::string what;
  Times seconds;                // of it once
  double bytes = 0;             // read + written; 0: it moves nothing
  std::optional<int64_t> lost;  // bytes that are not what was copied, launches that did nothing, walks that ended
                                // elsewhere, meetings that were missed; absent: no result
};
// One thread: a copy. All threads: copies by one and by all of them, launches of an empty kernel with one block and
// with as many as a launch has at most. A device: a copy, graphs that are chains of 40 and of 400 empty kernels, reads
// that wait for each other, kernels whose blocks meet 100 and 1100 times.
std::vector<MachineLimit> measure_machine_limits(const harness::BackendDescriptor& backend, int repeats);

}  // namespace cutproof::benchmarks
