// `cutproof bench rotations`: methods for the rotation of a cluster, on every hard case (method.md, Rotations).
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "benchmarks/machine_limits.h"
#include "benchmarks/provenance.h"
#include "benchmarks/rotations.h"

namespace cutproof::benchmarks {

struct RotationsOptions {
  std::string backend = harness::kReferenceName;
  RotationCounts counts;
  std::optional<int64_t> timed;  // matrices that are timed together; absent: by backend
};

struct RotationsResult {
  Provenance provenance;
  RotationCounts counts;
  MachineLimits machine;
  RotationReport report;  // empty before it is complete
  bool complete = false;
  bool holds() const { return report.default_holds(); }
};
nlohmann::json to_json(const RotationsResult& result);

// `step`: see RotationProgress.
RotationsResult run_rotations(const RotationsOptions& options, const Progress<RotationsResult>& progress,
                              const RotationProgress& step);

}  // namespace cutproof::benchmarks
