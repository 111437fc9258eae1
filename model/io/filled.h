// Sentences and cells of tables from a result document, so that people and programs read the same numbers.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::io {

// `text` with figures of `values` in its braces. {field}; {field/of/that}; {1e3*field:.4g}: a factor, and a format of
// fmt. Words stay as they are, true is "yes", and an absent figure (null) is "-". Throws nlohmann::json::out_of_range
// for a field that is not there.
std::string filled(const std::string& text, const nlohmann::json& values);
// The same, each figure as `figure` writes it.
using Figure = std::function<std::string(const std::string& path, double factor, const std::string& format)>;
std::string filled(const std::string& text, const Figure& figure);

}  // namespace cutproof::io
