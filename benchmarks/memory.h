// How much memory is in use, to tell what a backend keeps by the difference.
#pragma once
#include <cstdint>
#include <optional>

#include "harness/backends.h"

namespace cutproof::benchmarks {

// Bytes in use where `backend` keeps its state: on the device, or by this process, as its allocator counts them;
// absent where that is not known. Throws MachineError if CUDA fails.
std::optional<int64_t> bytes_in_use(const harness::BackendDescriptor& backend);

}  // namespace cutproof::benchmarks
