// Files from outside, as bytes. Whatever lies there, nothing hangs and no more is read than is allowed.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "model/io/limits.h"

namespace cutproof::io {

// Throws InputError if there is no regular file of this name (links are followed), before anything is opened: opening a
// pipe waits, and a device may act. Returns its size, which is 0 where it is not known (/proc).
uint64_t require_regular_file(const std::string& path);

// The whole of a regular file. Throws InputError if it is none, if it cannot be read, or if it has more than `most`
// bytes, also where its size is not known before (/proc) or grows meanwhile; MachineError if the system has no file
// descriptor left. `what` begins a sentence: "A scene".
std::string read_file(const std::string& path, std::string_view what, uint64_t most);
// The same of a JSON file, within the limits of its kind.
std::string read_file(const std::string& path, const JsonLimits& limits);

}  // namespace cutproof::io
