// The backends under test of a suite that times whole scenes.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "harness/backends.h"

namespace cutproof::benchmarks {

struct Contender {
  const harness::BackendDescriptor* described = nullptr;
  std::string rotation, split;
  std::unique_ptr<Backend> instance;
};
// One for each way of splitting: `split` is blocks, global, both, or empty for the default. Throws InputError, or
// MachineError if there is no device.
std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation);

// `single` or `double`.
const char* name_of(Precision precision);

}  // namespace cutproof::benchmarks
