// What the device can do at best, measured: times are given as multiples of these (results_schema.md,
// cutproof bench machine_limits).
#pragma once
#include <cstdint>
#include <vector>

namespace cutproof::gpu {

struct DeviceLimits {
  double copy_bytes_per_second = 0;  // device to device, read + written, buffers beyond the caches
  double graph_node_seconds = 0;     // what one more empty kernel costs in a graph that is a chain
  double chain_seconds = 0;          // of a graph of 40 empty kernels, one after the other

  // What these are from [s]: every copy of `copy_bytes` (read + written), every run of a graph of 40 or 400 kernels.
  std::vector<double> copy, short_chain, long_chain;
  double copy_bytes = 0;
  int64_t bytes_lost = 0;  // of the last 16 MiB: those that are not what was copied
};

// On the current device, in less than a second with few repeats; medians. Requires repeats >= 1. Throws MachineError if
// CUDA fails.
DeviceLimits measure_device_limits(int repeats = 21);

// Bytes of the current device's memory that are in use, by whomever. Throws MachineError if CUDA fails.
int64_t device_bytes_in_use();

}  // namespace cutproof::gpu
