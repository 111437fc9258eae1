// `cutproof bench baselines`: this method beside deletion, other expansion, detection and merging.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/baselines.h"
#include "benchmarks/provenance.h"

namespace cutproof::benchmarks {

struct BaselinesOptions {
  std::string backend = harness::kReferenceName;
  int64_t particles = 1500;
  uint64_t seed = 1;  // of the clusters
};

struct BaselinesResult {
  struct Row {
    Baseline baseline;
    BaselineRow found;
  };
  Provenance provenance;
  int64_t particles_asked = 0, particles = 0;
  double spacing = 0;  // [m]
  uint64_t seed = 0;
  std::vector<Row> rows;  // this method first
  bool complete = false;
  // This method left nothing isolated and all components equal, in every frame.
  bool holds() const;
};
nlohmann::json to_json(const BaselinesResult& result);

BaselinesResult run_baselines(const BaselinesOptions& options, const Progress<BaselinesResult>& progress);

}  // namespace cutproof::benchmarks
