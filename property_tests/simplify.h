// The simplest case that still fails.
#pragma once
#include <memory>
#include <string>

#include "harness/backends.h"
#include "property_tests/campaign.h"
#include "property_tests/counterexample.h"

namespace cutproof::property_tests {

struct Simplified {
  Counterexample counterexample;
  Verdict verdict;     // the failure of the shrunk case
  bool alone = false;  // fails without the other bodies of its batch
};
// The simplest failing case, and under a chosen schedule the fewest failing preemptions, found within this time [s] or
// until a stop is asked. The last attempt is completed. 0: the case as drawn.
Simplified simplify(const Violation& violation, const harness::BackendChoice& choice, double seconds,
                    const StopAsked& stop_asked = {});

// The case as drawn, without running it.
Simplified as_drawn(const Violation& violation, const harness::BackendChoice& choice);

// The backend with which a counterexample is run again: under its schedule, if it has one and the backend takes one.
std::unique_ptr<Backend> backend_of(const Counterexample& counterexample, const harness::BackendChoice& choice);

}  // namespace cutproof::property_tests
