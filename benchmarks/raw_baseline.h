// Kernels written twice, against DeviceBlock and as plain CUDA, to measure the cost of the launch layer
// (docs/design/kernels.md, Blocks).
#pragma once
#include <string>
#include <vector>

namespace cutproof::gpu {

struct KernelCost {
  int registers = 0;        // per thread
  std::size_t stack = 0;    // bytes of local memory per thread, spills included
  std::size_t shared = 0;   // bytes of shared memory per block that the code declares
  double microseconds = 0;  // median of the launches
};

struct KernelComparison {
  std::string kernel;
  long long items = 0;
  KernelCost layer, raw;   // against DeviceBlock; as plain CUDA
  bool same_bits = false;  // both wrote the same
};

// Runs both versions of each kernel `launches` times in turns on the current device, for about `particles` particles.
// Requires particles >= 1, launches >= 1. Throws MachineError if CUDA fails.
std::vector<KernelComparison> compare_with_raw(long long particles, int launches);

// The device's name and the results, as a JSON object.
std::string raw_baseline_json(const std::vector<KernelComparison>& results);

}  // namespace cutproof::gpu
