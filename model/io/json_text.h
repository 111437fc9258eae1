// JSON as text.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::io {

// Valid JSON in UTF-8 for any texts. Bytes of a text that are not UTF-8, as in a file's name, are written as \xe9 (in
// JSON: \\xe9), and characters that act on a terminal are escaped. `indent`: as nlohmann::json::dump().
std::string json_text(const nlohmann::json& document, int indent = -1);

}  // namespace cutproof::io
