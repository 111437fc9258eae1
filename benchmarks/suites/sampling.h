// `cutproof bench sampling`: Table 2 of the paper, a kidney's discontinuous cut at four samplings.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/measured_scene.h"
#include "benchmarks/paper.h"
#include "benchmarks/provenance.h"

namespace cutproof::benchmarks {

struct SamplingOptions : TimingOptions {
  std::string cooking = "boxes";
  bool full = false;  // the paper's counts of particles
};

struct SamplingRow {
  SceneRow scene;
  PaperSampling paper;
  double frame_to_first = 0, paper_frame_to_first = 0;  // median of a frame over that of the first row
};

struct SamplingResult {
  Provenance provenance;
  int64_t frames = 0, repeats = 0;
  std::string cooking;
  int64_t scaled_down = 1;  // by what the paper's counts of particles are divided
  std::vector<SamplingRow> rows;
  bool complete = false;
  bool holds() const;
};
nlohmann::json to_json(const SamplingResult& result);

SamplingResult run_sampling(const SamplingOptions& options, const Progress<SamplingResult>& progress);

}  // namespace cutproof::benchmarks
