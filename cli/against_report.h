// `cutproof run --against reference`: how a comparison is printed and written (docs/reference/schemas/against.json).
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "harness/against.h"

namespace cutproof::cli {

// All but the verdicts. `setup`: what was compared.
nlohmann::json to_json(const harness::Against& against, const Setup& setup);
// The worst of each measure: `greatest` of the document's `lockstep`.
nlohmann::json worst_json(const harness::Lockstep& lockstep);

// The table, the verdicts and the first difference, for a person.
// `again`: the command that shows it again.
void print_against(const harness::Against& against, const std::string& again);

}  // namespace cutproof::cli
