// What the device can do at best, measured: times are given as multiples of these (json.md,
// cutproof bench machine_limits).
#pragma once
#include <cstdint>
#include <vector>

namespace cutproof::gpu {

struct DeviceLimits {
  double copy_bytes_per_second = 0;  // device to device, read + written, buffers beyond the caches
  double graph_node_seconds = 0;     // what one more empty kernel costs in a graph that is a chain
  double chain_seconds = 0;          // of a graph of 40 empty kernels, one after the other
  double l2_round_trip_seconds = 0;  // from one read to the next that needs what it brings, past the first cache
  double grid_sync_seconds = 0;      // a barrier of as many blocks as there are multiprocessors

  // What these are from [s]: every copy of `copy_bytes` (read + written), every run of a graph of 40 or 400 kernels,
  // every walk of kWalk dependent reads, every kernel that meets kFewMeetings or kManyMeetings times.
  std::vector<double> copy, short_chain, long_chain, walk, few_meetings, many_meetings;
  double copy_bytes = 0;
  int64_t bytes_lost = 0;       // of the last 16 MiB: those that are not what was copied
  int64_t walks_lost = 0;       // that did not end where the walk ends
  int64_t meetings_missed = 0;  // threads that went on from a meeting before another had come, at the last of a kernel

  static constexpr int kWalk = 1 << 15, kFewMeetings = 100, kManyMeetings = 1100;
};

// On the current device, in about a second with few repeats; medians. Requires repeats >= 1. Throws MachineError if
// CUDA fails.
DeviceLimits measure_device_limits(int repeats = 21);

// Bytes of the current device's memory that are in use, by whomever. Throws MachineError if CUDA fails.
int64_t device_bytes_in_use();

}  // namespace cutproof::gpu
