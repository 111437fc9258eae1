// Principal stretches of clusters: the greatest singular value of F = A A0⁺, with A = Σ w (x - t)(X - T)ᵀ and A0 = Σ w
// (X - T)(X - T)ᵀ, w = m / n (method.md §4). In extended precision, so that only the rounding of the judged values is
// left.
#include "oracles/strain.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "oracles/rounding.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {
namespace {

using Wide = Eigen::Matrix<long double, 3, 3>;
using WideVector = Eigen::Matrix<long double, 3, 1>;

WideVector widened(Vec3 v) { return {v.x, v.y, v.z}; }

// Directions in which a cluster has no extent say nothing, and F is 0 there. Connected clusters are flat along the
// grid's axes only, where rounding leaves far less than the lower figure, and have far more than the upper one along
// others unless they are a thousand particles long. Between them it is open what a backend takes for flat.
constexpr long double kFlat = 0x1p-48L, kExtended = 0x1p-20L;

// Pivots up to this part of the greatest say that a direction is flat (method.md §4). Rounded coordinates can leave
// more, and then F along it is a quotient of two roundings.
constexpr long double kPivot = 3 * 0x1p-52L;

// Beyond this a sum of squares may be more than single precision can hold.
constexpr long double kMeasurable = 1e15L;

// Rounding band of the stretch σ, with u that of what is judged and N the particles of the cluster. A and A0 are sums
// of N products of rounded differences and weights: off by at most (N + 8) u times Σ w |x - t||X - T| and Σ w |X - T|²;
// a backend that works with displacements, F = 1 + (A - A0) A0⁺, by as much of both together. Errors of the means enter
// in second order, because Σ w (X - T) is zero. So F is off by (N + 8) u (S1 + (1 + σ) S2) / λ, λ the least eigenvalue
// of A0 that is not zero. Twice that covers eigenvalues found by some sweeps of rotations in the same precision, and so
// does 64 u σ for those of FᵀF, the root, and the threshold as it is stored. Absolute coordinates are off by p at rest,
// and by the rounding of their means. That puts A off by p Σ w |x - t| and A0 by 2 p Σ w |X - T|, and both by M e²,
// with e the rounding of a mean.
constexpr long double kTerms = 8, kSweeps = 64;

struct ClusterStretch {
  long double stretch = 0, band = 0;
  bool is_open = false;             // which direction is flat, or whether it can be computed at all
  bool may_seem_stretched = false;  // along a direction that is flat but for rounding
};

ClusterStretch stretch_of_cluster(const WeightedRest& rest, const State& state, int32_t cluster, double u) {
  const auto members = state.clusters.of(cluster);
  if (members.size() == 1) return {};  // it has no extent, whatever rounding leaves of its center
  long double mass = 0, heaviest = 0;
  WideVector rest_center = WideVector::Zero(), center = WideVector::Zero();
  for (const int32_t i : members) {
    const long double w = rest.weight[at(i)];
    mass += w;
    heaviest = std::max(heaviest, w);
    rest_center += w * widened(rest.position[at(i)]);
    center += w * widened(state.x[at(i)]);
  }
  rest_center /= mass;
  center /= mass;
  Wide a = Wide::Zero(), a0 = Wide::Zero();
  long double s1 = 0, s2 = 0, arms_now = 0, arms_at_rest = 0;
  for (const int32_t i : members) {
    const long double w = rest.weight[at(i)];
    const WideVector from = widened(rest.position[at(i)]) - rest_center, to = widened(state.x[at(i)]) - center;
    a += w * to * from.transpose();
    a0 += w * from * from.transpose();
    s1 += w * to.norm() * from.norm();
    s2 += w * from.squaredNorm();
    arms_now += w * to.norm();
    arms_at_rest += w * from.norm();
  }
  if (!a.allFinite()) return {0, 0, true};
  const Eigen::SelfAdjointEigenSolver<Wide> extents(a0);
  const WideVector lambda = extents.eigenvalues();  // ascending
  ClusterStretch found;
  if (!(lambda[2] > 0)) return found;
  const auto n = static_cast<long double>(members.size());
  const double mean = absolute_mean_rounding(
      state, sum_rounds_at_most(static_cast<double>(n), static_cast<double>(mass), static_cast<double>(heaviest)));
  const long double of_means = mass * mean * mean, p = state.place_rounding;
  Wide along = Wide::Zero();  // F times the eigenvectors
  long double least = lambda[2];
  for (int k = 0; k < 3; ++k) {
    if (lambda[k] <= kFlat * lambda[2]) {
      found.may_seem_stretched |= mass * (p + mean) * (p + mean) > kPivot * lambda[2];
      continue;
    }
    if (lambda[k] < kExtended * lambda[2]) found.is_open = true;
    least = std::min(least, lambda[k]);
    along.col(k) = a * extents.eigenvectors().col(k) / lambda[k];
  }
  const Eigen::SelfAdjointEigenSolver<Wide> stretches(along.transpose() * along, Eigen::EigenvaluesOnly);
  found.stretch = std::sqrt(std::max(0.0L, stretches.eigenvalues()[2]));
  found.is_open = found.is_open || !(found.stretch < kMeasurable);
  const long double a_off = (n + kTerms) * u * s1 + p * arms_now + of_means;
  const long double a0_off = (n + kTerms) * u * s2 + 2 * p * arms_at_rest + of_means;
  found.band = 2 * (a_off + (1 + found.stretch) * a0_off) / least + kSweeps * u * found.stretch;
  return found;
}

}  // namespace

std::vector<StrainDemand> demands_of_strain(const Setup& setup, const State& state) {
  std::vector<StrainDemand> demands(state.x.size());
  const WeightedRest rest = weighted_rest(setup.body, state.clusters);
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    if (state.clusters.size(c) == 0) continue;  // coverage rejects it
    const ClusterStretch found = stretch_of_cluster(rest, state, c, unit_roundoff(state));
    const long double limit = setup.detect.strain;
    const Demand demand = found.is_open                                                    ? Demand::either
                          : found.stretch - found.band > limit                             ? Demand::remove
                          : found.stretch + found.band > limit || found.may_seem_stretched ? Demand::either
                                                                                           : Demand::keep;
    for (const int32_t i : state.clusters.of(c)) {
      StrainDemand& of_particle = demands[at(i)];
      of_particle.demand = std::max(of_particle.demand, demand);
      of_particle.stretch = std::max(of_particle.stretch, static_cast<double>(found.stretch));
    }
  }
  return demands;
}

}  // namespace cutproof::oracles
