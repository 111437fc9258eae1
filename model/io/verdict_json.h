// A verdict in a result document, and in words (json.md, Verdicts).
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/verdict.h"

namespace cutproof::io {

// `expected_failure`: the scene expects this failure.
nlohmann::json verdict_json(const Verdict& verdict, bool expected_failure);
// A list of those of which none is expected to fail. `in_stages`: else they are on what has no stages, and name none.
nlohmann::json verdicts_json(const std::vector<Verdict>& verdicts, bool in_stages = true);
// A figure with its unit, for a person: counts and ratios, whose unit is "1", have none.
std::string in_unit(const std::string& figure, const std::string& unit);
// Share of the bound, for a person. 1 is shown only for a value exactly at its bound, neither for one just below nor
// for one just beyond.
std::string share_of(double of_bound);
// One that fails, in one line for a person (tutorial.md, Reading a verdict).
std::string verdict_text(const Verdict& verdict);
// The measured value, the bound and the witness of a verdict.
std::string measured_text(const Verdict& verdict);

}  // namespace cutproof::io
