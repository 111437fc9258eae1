// Converts between numbers of model/ (64 bits), of kernels (32 bits) and of containers.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::gpu {

// Throws MachineError if the value exceeds what kernels can index. `what`: the counted things, in the plural.
inline int narrow(int64_t value, const char* what) {
  if (value > std::numeric_limits<int>::max()) {
    throw MachineError(std::string("the kernels index with 32 bits, and this load has too many ") + what + ": " +
                       std::to_string(value));
  }
  return static_cast<int>(value);
}

}  // namespace cutproof::gpu
