// `cutproof bench scale`: what a frame takes from a thousand particles to ten million.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "benchmarks/measured_scene.h"
#include "benchmarks/provenance.h"

namespace cutproof::benchmarks {

struct ScaleOptions : TimingOptions {
  std::vector<int64_t> sizes;  // particles; empty: by backend
};

struct ScaleRow {
  SceneRow scene;
  double particles_per_second = 0;  // of the median frame
  std::optional<int64_t> bytes;     // that the backend keeps; absent: not known
};

struct ScaleResult {
  Provenance provenance;
  int64_t frames = 0, repeats = 0;
  std::vector<ScaleRow> rows;
  bool complete = false;
  bool holds() const;
};
nlohmann::json to_json(const ScaleResult& result);

ScaleResult run_scale(const ScaleOptions& options, const Progress<ScaleResult>& progress);

}  // namespace cutproof::benchmarks
