// JSON from outside, as a tree.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "model/io/limits.h"

namespace cutproof::io {

// Throws InputError, naming `file` (and line and column, or the field), for what is not valid JSON in UTF-8, goes
// beyond the limits, names a field of one object twice (JSON libraries let that pass, and then one of the two is lost),
// or has a number that is not finite. Limits are checked before the tree is made. `remedy`: the remedy if the file is
// not JSON at all, as a sentence.
nlohmann::json parse_json(const std::string& text, const std::string& file, const JsonLimits& limits,
                          const std::string& remedy);
// The same of a file.
nlohmann::json read_json(const std::string& file, const JsonLimits& limits, const std::string& remedy);

// "parts.shape": a field within a field.
std::string join(const std::string& path, std::string_view name);

}  // namespace cutproof::io
