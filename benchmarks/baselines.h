// Other methods of cutting, and how they are compared with this one.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "benchmarks/times.h"
#include "harness/errors.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::benchmarks {

// What becomes of clusters that lost particles, where no stage of a backend does that.
enum class Deletion {
  none,       // the backend's own split, merge and expand
  particles,  // dead particles leave their clusters, which stay whole: no split, no merge, no expansion
  clusters,   // clusters that lost a particle go, and with them particles that lie in no other
};

struct Baseline {
  std::string name;
  std::string source;  // where it comes from
  ExpandRule expand = ExpandRule::edge_cover;
  MergeRule merge = MergeRule::deterministic;
  Criterion criterion = Criterion::distance;
  Deletion deletion = Deletion::none;
};
// This method first.
const std::vector<Baseline>& baselines();

// A kidney of sampled clusters, held at both ends; a blade goes an irregular way through its upper part, then straight
// through all of it, and the ends are pushed towards each other. The clusters are cooked with the baseline's rules.
struct BaselineScene {
  Setup setup;
  State state;
};
// Throws InputError if no kidney has so many particles, within 2 %.
BaselineScene make_baseline_scene(const Baseline& baseline, int64_t particles, uint64_t seed);

// Takes dead particles out of the clusters, in one of the two ways; recomputes rest frames. Whoever dies too is added
// to state.removed. The skin is dropped, so that the next skin stage makes it anew. Requires a state after detection.
void delete_from_clusters(const Setup& setup, Deletion deletion, State& state);

struct BaselineRow {
  Times frame;  // [s] deletion: of step, detect and skin
  int64_t frames = 0, removed = 0, clusters_before = 0, clusters = 0;
  harness::TopologyFigures end;
  int64_t isolated = 0;        // the most in one frame
  int64_t unequal_frames = 0;  // in which tissue, coupling and skin do not have the same components
  oracles::CutGeometry geometry;
  oracles::Interpenetration overlap;  // the greatest of those looked at
};
BaselineRow run_baseline(Backend& backend, const Baseline& baseline, BaselineScene scene);

}  // namespace cutproof::benchmarks
