// The page's template, filled.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cutproof::report {

// How a page was made, for its head.
struct Made {
  std::string program;                               // version of this program
  std::string command = {};                          // the command line
  std::string date = {}, machine = {}, commit = {};  // empty: not known
};
nlohmann::json to_json(const Made& made);

// `data`: JSON as it may stand in a script element (script_json). Base64: `chunks`, elements chunk-0, chunk-1, ..., and
// those of a run beside it, beside-0, beside-1, ...
std::string html(const std::string& data, const std::vector<std::string>& chunks,
                 const std::vector<std::string>& beside = {});

}  // namespace cutproof::report
