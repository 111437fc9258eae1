// Other methods of cutting, compared with this one.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/scene.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::benchmarks {

// Treatment of clusters that lost particles, outside the backend's stages.
enum class Deletion {
  none,       // the backend's own split, merge and expand
  particles,  // dead particles leave their clusters; no split, no merge, no expansion
  clusters,   // clusters that lost a particle are removed, with particles that are in no other
};

struct Baseline {
  std::string name;
  std::string source;  // publication
  ExpandRule expand = ExpandRule::edge_cover;
  MergeRule merge = MergeRule::deterministic;
  Criterion criterion = Criterion::distance;
  RemovedEnds remove = RemovedEnds::both;
  Deletion deletion = Deletion::none;
};
// The first is this method.
const std::vector<Baseline>& baselines();

// The scene baselines.json, its clusters cooked with the baseline's rules.
// Throws InputError if no kidney has so many particles, within 2 %.
ReadyScene make_baseline_scene(const Baseline& baseline, int64_t particles, uint64_t seed);

// Removes dead particles from the clusters in one of the two ways and recomputes rest frames. Adds further dead
// particles to state.removed. Drops the skin, so that the next skin stage makes it anew. Requires a state after
// detection.
void delete_from_clusters(const Setup& setup, Deletion deletion, State& state);

// One frame of what the backend has loaded. Returns its seconds [s]; with a deletion, of step, detect and skin.
double run_frame(Backend& backend, const Baseline& baseline, const Setup& setup);

// The baseline's row of the document (docs/reference/schemas/bench_baselines.json).
nlohmann::json run_baseline(Backend& backend, const Baseline& baseline, const ReadyScene& scene);

}  // namespace cutproof::benchmarks
