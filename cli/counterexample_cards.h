// Counterexamples on a page: each run again as `cutproof replay` does, beside the reference.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "harness/backends.h"
#include "property_tests/counterexample.h"
#include "report/document_page.h"

namespace cutproof::cli {

// Adds to `card` the case, its present result and the command that shows it, and to `sceneries` its states, as long as
// there is room. `chosen`: the backend to run it on; by default the one that failed, unless that is a plugin: a
// document must not start an arbitrary library. Returns whether the case fails; nothing if it was not run.
std::optional<bool> add_counterexample(report::Card& card, const property_tests::Counterexample& counterexample,
                                       const std::string& file, const std::optional<harness::BackendChoice>& chosen,
                                       std::vector<report::Scenery>& sceneries);

// The sheet of counterexamples alone. `files`: of each, where it lies.
report::Sheet counterexample_sheet(const std::vector<property_tests::Counterexample>& counterexamples,
                                   const std::vector<std::string>& files,
                                   const std::optional<harness::BackendChoice>& chosen,
                                   std::vector<report::Scenery>& sceneries);

}  // namespace cutproof::cli
