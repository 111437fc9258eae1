// Between the numbers of model/, 64 bits wide, those of the kernels, 32 bits wide, and those of containers.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::gpu {

// Throws MachineError if there are more of them than kernels can index. `what`: of what, in the plural.
inline int narrow(int64_t value, const char* what) {
  if (value > std::numeric_limits<int>::max()) {
    throw MachineError(std::string("the kernels index with 32 bits, and this load has too many ") + what + ": " +
                       std::to_string(value));
  }
  return static_cast<int>(value);
}

}  // namespace cutproof::gpu
