// What the device can do at best, measured: times are told as multiples of these (docs/accuracy_and_speed.md §5).
#pragma once

namespace cutproof::gpu {

struct Floors {
  double copy_bytes_per_second = 0;  // device to device, read + written, buffers beyond the caches
  double graph_node_seconds = 0;     // what one more empty kernel costs in a graph that is a chain
  double chain_seconds = 0;          // of a graph of 40 empty kernels, one after the other
};

// On the current device, in less than a second; medians. Throws MachineError if CUDA fails.
Floors measure_floors();

}  // namespace cutproof::gpu
