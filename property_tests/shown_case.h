// A case run alone, with every state kept, for somebody to look at.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "harness/moments.h"
#include "model/backend.h"
#include "property_tests/cases.h"

namespace cutproof::property_tests {

struct ShownCase {
  Instance loaded;
  harness::Trace trace;
  std::string problem;  // why there is no trace; empty: there is
};
// Throws MachineError, and InputError where the backend cannot be made.
ShownCase run_to_show(const std::function<std::unique_ptr<Backend>()>& make, const Case& c);

// What a case is, in a few words: "12 particles, boxes of 5 nodes, 2 strokes, ...".
std::string in_words(const Case& c);

}  // namespace cutproof::property_tests
