// `cutproof bench clusters`: Fig. 10 of the paper, how the number of clusters changes while a kidney is cut through.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/provenance.h"
#include "benchmarks/times.h"
#include "model/verdict.h"

namespace cutproof::benchmarks {

struct ClustersOptions {
  std::string backend = harness::kReferenceName, split;
  std::vector<double> taus = {0.25, 0.5, 0.75};  // each a curve, and one without merging
  std::optional<int64_t> particles;
  bool full = false;  // the paper's count of particles
};

// One curve: the same cut with one rule of merging.
struct ClustersRow {
  // Multiple of the median size at cooking below which a cluster is small; absent: nothing is merged.
  std::optional<double> tau;
  std::string backend, precision, split;
  int64_t particles = 0, removed = 0;
  std::vector<int64_t> scene_frame, clusters;  // [frames + 1], [0]: before the first one
  std::vector<double> seconds;                 // of whole frames
  int64_t judged = 0;                          // verdicts
  std::vector<Verdict> failed;

  std::string name() const;
  double growth() const;  // from the first entry of `clusters` to the last
  double greatest_growth() const;
  int64_t clusters_at(int64_t scene_frame_end) const;  // at the end of that frame of the scene
};

struct ClustersResult {
  Provenance provenance;
  std::vector<ClustersRow> rows;  // one contender after the other
  bool complete = false;
  bool holds() const;  // no verdict fails
};
nlohmann::json to_json(const ClustersResult& result);

inline constexpr int64_t kPaperParticles = 37'704;  // of the scene: the first row of Table 2

ClustersResult run_clusters(const ClustersOptions& options, const Progress<ClustersResult>& progress);

}  // namespace cutproof::benchmarks
