// `cutproof bench machine_limits`: what nothing on this machine can be faster than.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/machine_limits.h"
#include "benchmarks/provenance.h"

namespace cutproof::benchmarks {

struct MachineLimitsOptions {
  std::string backend = harness::kReferenceName;
  int repeats = 21;
};

struct MachineLimitsResult {
  Provenance provenance;
  int repeats = 0;
  std::vector<MachineLimit> rows;
  bool complete = false;
  bool holds() const;  // nothing was lost
};
nlohmann::json to_json(const MachineLimitsResult& result);

// Throws InputError for options that make no sense, MachineError if the machine fails; so do all suites.
MachineLimitsResult run_machine_limits(const MachineLimitsOptions& options,
                                       const Progress<MachineLimitsResult>& progress);

}  // namespace cutproof::benchmarks
