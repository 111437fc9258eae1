// Internal to oracles/: the sums of shape matching (method.md §2, §3), implemented a second time so that no oracle
// trusts a backend's values, and the constants of the rounding bounds of tolerances.md.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/support.h"

namespace cutproof::oracles {

// u: relative error of one rounding in double precision.
inline constexpr double kUnitRoundoff = 0x1p-53;

// A cluster's weighted means at rest and now, recomputed from the memberships.
struct ClusterMeans {
  double mass = 0;  // M_c [kg]
  Vec3 rest;        // T_c [m]
  Vec3 current;     // t_c [m]
};

// Terms of the means of many clusters, computed once for each particle.
struct WeightedRest {
  std::vector<double> weight;  // [n] w_ic = m_i / n_i, the same for every cluster of i; 0 if the particle lies in none
  std::vector<Vec3> position;  // [n] X_i [m]
};

inline WeightedRest weighted_rest(const Body& body, const Clusters& clusters) {
  WeightedRest rest;
  const std::vector<int32_t> counts = membership_counts(clusters, body.particle_count());
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    rest.weight.push_back(counts[at(i)] > 0 ? body.mass[at(i)] / counts[at(i)] : 0);
    rest.position.push_back(body.rest_position(i));
  }
  return rest;
}

inline ClusterMeans cluster_means(const WeightedRest& rest, const Clusters& clusters, const std::vector<Vec3>& x,
                                  int32_t cluster) {
  ClusterMeans means;
  for (const int32_t particle : clusters.of(cluster)) {
    const double w = rest.weight[at(particle)];
    means.mass += w;
    means.rest += w * rest.position[at(particle)];
    means.current += w * x[at(particle)];
  }
  means.rest = means.rest / means.mass;
  means.current = means.current / means.mass;
  return means;
}

// Figures that enter every rounding bound of tolerances.md.
struct RoundingScale {
  int64_t largest_cluster = 0;     // N: most particles in one cluster
  int32_t most_memberships = 0;    // n: most clusters of one particle
  double unit_roundoff = 0x1p-53;  // u of the arithmetic that is judged
  double extent = 0;               // greatest |x| or |X| of an alive particle from the body's origin [m]
};

inline RoundingScale rounding_scale(const Setup& setup, const State& state) {
  RoundingScale scale;
  scale.unit_roundoff = unit_roundoff(state);
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    scale.largest_cluster = std::max(scale.largest_cluster, state.clusters.size(c));
  }
  for (const int32_t count : membership_counts(state.clusters, setup.body.particle_count())) {
    scale.most_memberships = std::max(scale.most_memberships, count);
  }
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!state.alive[at(i)]) continue;
    scale.extent = std::max({scale.extent, norm(setup.body.rest_position(i)), norm(state.x[at(i)])});
  }
  return scale;
}

// tolerances.md, "One goal position": the error of one evaluation of g_i or of a skin vertex, given the
// rotations [m].
inline double goal_rounding(const RoundingScale& scale) {
  const double operations = 2.0 * static_cast<double>(scale.largest_cluster) + scale.most_memberships + 16.0;
  return 3.0 * std::sqrt(3.0) * operations * scale.unit_roundoff * scale.extent;
}

// Greatest growth of a single error of an iterate in later iterations: the plain iteration never enlarges it;
// Chebyshev's weights do (tolerances.md, Accelerated steps: 6.3).
inline double error_growth(const StepParameters& step) {
  return step.acceleration == Acceleration::chebyshev ? 7.0 : 1.0;
}

}  // namespace cutproof::oracles
