// JSON as text.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::io {

// Valid JSON in UTF-8 whatever the texts in it hold: of a text that is no UTF-8, such as a file's name, the bytes that
// are none stand there as \xe9 (in JSON: \\xe9), and what would act on a terminal is escaped. `indent`: as
// nlohmann::json::dump().
std::string json_text(const nlohmann::json& document, int indent = -1);

}  // namespace cutproof::io
