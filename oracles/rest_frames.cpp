// Rest centers and masses of clusters (method.md §5).
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "oracles/checks.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

// Bound. A sum of k products of positive weights and coordinates, in any order, is off by at most (k + 2) u Σ w |X|
// per axis to first order in u (Higham 2002, §3.1: k - 1 additions, one product, and one division for w = m / n);
// Σ w by (k + 1) u Σ w; the quotient adds one u. With |X| <= L: (2k + 4) u L per axis, twice that because both sides
// round, √3 for three axes; 8 (k + 2) u L covers it. The mass obeys the same bound relative to itself, because L >= h.
void check_rest_frames(Judged& judged, Verdict& verdict) {
  const double h = judged.body.grid.spacing;
  // Dead members count too: between detect and split the frames are those of before.
  const WeightedRest weighted = weighted_rest(judged.body, judged.clusters);
  double reach = h;
  for (const Vec3 position : weighted.position) reach = std::max(reach, norm(position));
  int64_t largest = 0;
  int32_t worst = -1;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    if (judged.clusters.size(c) == 0) continue;  // coverage rejects it
    ++verdict.checked;
    largest = std::max(largest, judged.clusters.size(c));
    const ClusterMeans means = cluster_means(weighted, judged.clusters, judged.state.x, c);
    const double center_error = norm(judged.clusters.rest_center[at(c)] - means.rest) / h;
    const double mass_error = std::abs(judged.clusters.mass[at(c)] - means.mass) / means.mass;
    const bool finite_error = std::isfinite(center_error) && std::isfinite(mass_error);
    const double error = finite_error ? std::max(center_error, mass_error) : std::numeric_limits<double>::max();
    if (error >= verdict.measured) {
      verdict.measured = error;
      worst = c;
    }
  }
  verdict.bound = 8.0 * static_cast<double>(largest + 2) * unit_roundoff(judged.state) * reach / h;
  if (verdict.measured <= verdict.bound) return;
  const Vec3 t = judged.clusters.rest_center[at(worst)];
  fail(verdict, {{judged.number(worst)}},
       "rest center ({}, {}, {}) m or mass {} kg of cluster {} is not the weighted sum over its {} particles; off by "
       "{} h",
       t.x, t.y, t.z, judged.clusters.mass[at(worst)], judged.number(worst), judged.clusters.size(worst),
       verdict.measured);
}

}  // namespace cutproof::oracles
