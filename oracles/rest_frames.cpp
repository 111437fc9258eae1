// Rest centers and masses of clusters (method.md §5).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

// Bounds: tolerances.md, Rest frames. The mean may be taken relative to a member, by absolute coordinates in double, or
// by absolute coordinates as they were handed over; in each of these sums in any order.
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
    double arms = 0, longest = 0, heaviest = 0, farthest = 0;  // Σ w |X − X of the first member|, and the greatest term
    for (const int32_t i : members) {
      const double w = weighted.weight[at(i)];
      const double arm = w * norm(weighted.position[at(i)] - weighted.position[at(members.front())]);
      arms += arm;
      longest = std::max(longest, arm);
      heaviest = std::max(heaviest, w);
      farthest = std::max(farthest, norm(weighted.position[at(i)]));
    }
    const auto terms = static_cast<double>(members.size());
    const double of_weights = sum_rounds_at_most(terms, means.mass, heaviest);
    const double relative = (sum_rounds_at_most(terms, arms, longest) + of_weights + 10) * u * arms / means.mass;
    const double in_doubles = 2 * (2 * of_weights + 4) * kUnitRoundoff * farthest;
    const double bound = relative + in_doubles + absolute_mean_rounding(judged.state, of_weights);
    nearest.see(norm(judged.clusters.rest_center[at(c)] - means.rest) / h, bound / h, c);
    nearest.see(std::abs(judged.clusters.mass[at(c)] - means.mass) / means.mass, (of_weights + 4) * u, c);
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
