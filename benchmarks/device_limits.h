// The device's measured limits; other times are multiples of these (json.md, cutproof bench machine_limits).
#pragma once
#include <cstdint>
#include <vector>

namespace cutproof::gpu {

struct DeviceLimits {
  double copy_bytes_per_second = 0;  // device to device, read + written, buffers beyond the caches
  double graph_node_seconds = 0;     // of one more empty kernel in a graph that is a chain
  double chain_seconds = 0;          // of a graph of 40 empty kernels, one after the other
  double l2_round_trip_seconds = 0;  // from a read past the first cache to the next one, which needs its result
  double grid_sync_seconds = 0;      // a barrier of as many blocks as there are multiprocessors

  // Samples [s]: each copy of `copy_bytes` (read + written), each run of a graph of 40 or 400 kernels, each walk of
  // kWalk dependent reads, each kernel that meets kFewMeetings or kManyMeetings times.
  std::vector<double> copy, short_chain, long_chain, walk, few_meetings, many_meetings;
  double copy_bytes = 0;
  int64_t bytes_lost = 0;       // wrong bytes of the last 16 MiB
  int64_t walks_lost = 0;       // walks with a wrong end
  int64_t meetings_missed = 0;  // threads that left a kernel's last meeting before another had come

  static constexpr int kWalk = 1 << 15, kFewMeetings = 100, kManyMeetings = 1100;
};

// On the current device, in about a second with few repeats; medians. Requires repeats >= 1. Throws MachineError if
// CUDA fails.
DeviceLimits measure_device_limits(int repeats = 21);

// Used bytes of the current device's memory, by any process. Throws MachineError if CUDA fails.
int64_t device_bytes_in_use();

}  // namespace cutproof::gpu
