// The backend under test of a suite that times whole scenes.
#pragma once
#include <memory>
#include <string>

#include "harness/backends.h"

namespace cutproof::benchmarks {

struct Contender {
  const harness::BackendDescriptor* described = nullptr;
  std::unique_ptr<Backend> instance;
};
// Throws InputError, or MachineError if there is no device.
Contender make_contender(const std::string& backend);

// `single` or `double`.
const char* name_of(Precision precision);

}  // namespace cutproof::benchmarks
