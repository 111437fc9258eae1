// A violation as data: `cutproof fuzz` saves it, `cutproof replay` and the property tests run it again. It is no seed,
// because seeds change their meaning when generators change.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "gpu/host/thread_schedule.h"
#include "property_tests/cases.h"
#include "property_tests/histories.h"

namespace cutproof::property_tests {

struct Counterexample {
  Case failing;
  std::vector<Command> commands;  // a history of that case; empty: it is dissected from beginning to end
  std::string backend;            // on which it was found; empty: that is not known
  gpu::ThreadSchedule schedule;   // `simulated`: the choices that make it fail; empty: none were recorded
  std::string found;              // the failure, for a person
  uint64_t seed = 0;              // of the campaign
  int64_t index = 0;              // of the case in it, before it was shrunk
};

// JSON, one line. The schedule is written as pairs [decision, choice] of the choices that are not 0.
std::string to_json(const Counterexample& counterexample);
// Throws InputError, naming `file`, for anything else. A line that to_json(Case) wrote is a counterexample, too.
Counterexample counterexample_from_json(const std::string& text, const std::string& file);
Counterexample read_counterexample(const std::string& file);

}  // namespace cutproof::property_tests
