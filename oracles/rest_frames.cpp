// Rest centers and masses of clusters (method.md §5).
#include <fmt/format.h>

#include <cmath>

#include "oracles/checks.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

// Bounds: tolerances.md, Detection and rest frames. The mean is taken relative to a member, as single precision has to
// (a sum of coordinates would lose their digits), or in double; or, in a state from a file, by absolute coordinates.
void check_rest_frames(Judged& judged, Verdict& verdict) {
  const double h = judged.body.grid.spacing, u = unit_roundoff(judged.state) + kUnitRoundoff;
  // Dead members count too: between detect and split the frames are those of before.
  const WeightedRest weighted = weighted_rest(judged.body, judged.clusters);
  Nearest nearest;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    const auto members = judged.clusters.of(c);
    if (members.empty()) continue;  // coverage rejects it
    ++verdict.checked;
    const ClusterMeans means = cluster_means(weighted, judged.clusters, judged.state.x, c);
    double arms = 0;  // Σ w |X − X of the first member|
    for (const int32_t i : members) {
      arms += weighted.weight[at(i)] * norm(weighted.position[at(i)] - weighted.position[at(members.front())]);
    }
    const double sums = kDeviations * sum_rounds(static_cast<double>(members.size()));
    const double by_sums = sums * (u * arms / means.mass + kUnitRoundoff * norm(means.rest)) +
                           absolute_place_bound(judged.state, static_cast<double>(members.size()));
    nearest.see(norm(judged.clusters.rest_center[at(c)] - means.rest) / h, by_sums / h, c);
    nearest.see(std::abs(judged.clusters.mass[at(c)] - means.mass) / means.mass, sums * u, c);
  }
  if (nearest.where < 0) return;
  verdict.measured = nearest.measured;
  verdict.bound = nearest.bound;
  const int32_t worst = nearest.where;
  if (nearest.holds()) return;
  const Vec3 t = judged.clusters.rest_center[at(worst)];
  fail(verdict, {{judged.number(worst)}},
       "rest center ({}, {}, {}) m or mass {} kg of cluster {} is not the weighted sum over its {} particles; off by "
       "{} h",
       t.x, t.y, t.z, judged.clusters.mass[at(worst)], judged.number(worst), judged.clusters.size(worst),
       verdict.measured);
}

}  // namespace cutproof::oracles
