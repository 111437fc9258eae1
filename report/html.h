// The page's template, filled.
#pragma once
#include <string>
#include <vector>

namespace cutproof::report {

// `data`: JSON as it may stand in a script element (script_json). `chunks`: base64, elements chunk-0, chunk-1, ...
std::string html(const std::string& data, const std::vector<std::string>& chunks);

}  // namespace cutproof::report
