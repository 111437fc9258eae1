// Kernels that are written twice, against DeviceBlock and as plain CUDA, to show that the launch layer costs nothing
// (docs/architecture.md, Kernels): registers and time within 2 %.
#pragma once
#include <string>
#include <vector>

namespace cutproof::gpu {

struct TwinCost {
  int registers = 0;        // per thread
  std::size_t stack = 0;    // bytes of local memory per thread, spills included
  std::size_t shared = 0;   // bytes of shared memory per block that the code asks for by itself
  double microseconds = 0;  // median of the launches
};

struct TwinResult {
  std::string kernel;
  long long items = 0;
  TwinCost layer, plain;
  bool same_bits = false;  // both wrote the same
};

// Runs both twins of each kernel `launches` times in turns on the current device, for about `particles` particles.
// Requires particles >= 1, launches >= 1. Throws MachineError if CUDA fails.
std::vector<TwinResult> compare_twins(long long particles, int launches);

// The device's name and the results, as a JSON object.
std::string twins_json(const std::vector<TwinResult>& results);

}  // namespace cutproof::gpu
