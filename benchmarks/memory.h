// How much memory is in use, to tell what a backend keeps by the difference.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace cutproof::cli {

// Bytes in use where `backend` keeps its state: on the device for `gpu`, else by this process, as its allocator counts
// them; absent where that is not known. Throws MachineError if CUDA fails.
std::optional<int64_t> bytes_in_use(const std::string& backend);

}  // namespace cutproof::cli
