// JSON from outside, as a tree.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "model/io/limits.h"

namespace cutproof::io {

// Throws InputError, naming `file` (and line and column, or the field), for text that is not valid JSON in UTF-8,
// exceeds the limits, has a number that is not finite, or names a field of one object twice. (JSON libraries accept
// such fields and lose one of the two.) Limits are checked before the tree is made. `remedy`: the remedy if the file is
// not JSON at all, as a sentence.
nlohmann::json parse_json(const std::string& text, const std::string& file, const JsonLimits& limits,
                          const std::string& remedy);
// The same of a file.
nlohmann::json read_json(const std::string& file, const JsonLimits& limits, const std::string& remedy);

// "parts.shape": a field within a field.
std::string join(const std::string& path, std::string_view name);

}  // namespace cutproof::io
