// Sentences and cells of tables from a result document, so that what a person reads and what a machine reads are one.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::io {

// `text` with figures of `values` in its braces. {field}; {field/of/that}; {1e3*field:.4g}: what it is multiplied by,
// and how it is written, as fmt has it. Words stay as they are, and an absent figure (null) is "-". Throws
// nlohmann::json::out_of_range for a field that is not there.
std::string filled(const std::string& text, const nlohmann::json& values);

}  // namespace cutproof::io
