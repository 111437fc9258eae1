// A verdict in a result document (results_schema.md, Verdicts).
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "model/verdict.h"

namespace cutproof::io {

// `expected_failure`: that it fails is what the scene expects.
nlohmann::json verdict_json(const Verdict& verdict, bool expected_failure);
// A list of those of which none is expected to fail.
nlohmann::json verdicts_json(const std::vector<Verdict>& verdicts);

}  // namespace cutproof::io
