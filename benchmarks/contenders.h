// The backends under test of a suite that times whole scenes.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "harness/backends.h"

namespace cutproof::benchmarks {

struct Contender {
  std::string backend, precision, rotation, split;
  bool pipelined = false;     // run() does not wait
  bool runs_kernels = false;  // its step moves what step_traffic counts
  std::unique_ptr<Backend> instance;
};
// One for each way of splitting: `split` is blocks, global, both, or empty for the default. Throws InputError, or
// MachineError if there is no device.
std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation);

// `single` or `double`.
const char* name_of(Precision precision);

}  // namespace cutproof::benchmarks
