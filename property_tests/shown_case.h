// A case run alone, with every state kept, for pages.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/moments.h"
#include "model/backend.h"
#include "property_tests/cases.h"
#include "property_tests/histories.h"

namespace cutproof::property_tests {

struct ShownCase {
  Instance loaded;
  harness::Trace trace;
  std::string problem;  // why there is no trace; empty: there is
};
// Throws MachineError, and InputError where the backend cannot be made.
ShownCase run_to_show(const std::function<std::unique_ptr<Backend>()>& make, const Case& c);
// The same of a history of that case, up to where it fails; or up to where its backend throws, if it ran until then.
ShownCase run_to_show(const std::function<std::unique_ptr<Backend>()>& make, const Case& c,
                      const std::vector<Command>& commands);

// A case in a few words: "12 particles, boxes of 5 nodes, 2 strokes, ...".
std::string in_words(const Case& c);
// The commands of a history, in order: "2 stages, then a kick, then ...".
std::string in_words(const std::vector<Command>& commands);

}  // namespace cutproof::property_tests
