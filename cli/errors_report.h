// `cutproof run --errors`: which errors are asked for, and how they are printed and written
// (docs/reference/schemas/errors.json).
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/errors.h"
#include "harness/lockstep.h"

namespace cutproof::cli {

// The names that errors_wanted() accepts.
std::vector<std::string> error_names();
// Names with commas between them, or `all`. Throws InputError.
harness::ErrorsWanted errors_wanted(const std::string& list);

// `lockstep` is null without the implementation error.
nlohmann::json to_json(const harness::Errors& errors, const harness::Lockstep* lockstep);
// `document`: from to_json.
void print_errors(const harness::Errors& errors, const nlohmann::json& document);

}  // namespace cutproof::cli
