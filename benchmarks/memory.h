// Memory in use; the difference of two values is what a backend keeps.
#pragma once
#include <cstdint>
#include <optional>

#include "harness/backends.h"

namespace cutproof::benchmarks {

// Bytes in use where `backend` keeps its state: on the device, or in this process by its allocator's count; absent if
// unknown. Throws MachineError if CUDA fails.
std::optional<int64_t> bytes_in_use(const harness::BackendDescriptor& backend);

}  // namespace cutproof::benchmarks
