// One substep of a body at rest, or thrown: the rest state is a fixed point, and a rigid translation is reproduced
// exactly.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/comparison/state_difference.h"
#include "oracles/eigen.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {
namespace {

// By how much a cluster's rotation amplifies an error of positions: Σ w |X − T| r / (σ2 + σ3) at rest, r the greatest
// distance from the center. Of a collinear cluster the rotation moves no particle.
double greatest_amplification(const Body& body, const Clusters& clusters) {
  double greatest = 0;
  const WeightedRest rest = weighted_rest(body, clusters);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans means = cluster_means(rest, clusters, rest.position, c);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    double moment = 0, radius = 0;
    for (const int32_t i : clusters.of(c)) {
      const Eigen::Vector3d d = as_eigen(rest.position[at(i)] - means.rest);
      const double w = rest.weight[at(i)];
      a += w * d * d.transpose();
      moment += w * d.norm();
      radius = std::max(radius, d.norm());
    }
    const Eigen::Vector3d sigma = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(a).eigenvalues();
    constexpr double kCollinear = 1e-12;
    const double gap = sigma[0] + sigma[1];  // ascending: the two smaller ones
    if (gap > kCollinear * sigma[2]) greatest = std::max(greatest, moment * radius / gap);
  }
  return greatest;
}

// How far rounding can carry a particle in one substep near the rest state [m] (tolerances.md, "One substep").
double substep_rounding(const Setup& setup, const State& state) {
  const Body& body = setup.body;
  double mass = 0, lightest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < body.mass.size(); ++i) {
    if (!state.alive[i]) continue;
    mass += body.mass[i];
    lightest = std::min(lightest, body.mass[i]);
  }
  if (mass == 0) return 0;
  const RoundingScale scale = rounding_scale(setup, state);
  return setup.step.iterations * error_growth(setup.step) * std::sqrt(mass / lightest) *
             (1 + greatest_amplification(body, state.clusters)) * goal_rounding(scale) +
         8 * scale.unit_roundoff * scale.extent;
}

// The same tissue and clusters, at rest; each particle with this velocity.
State at_rest(const Setup& setup, const State& state, Vec3 velocity) {
  State rest = state;
  rest.frame = 0;
  rest.v.assign(state.v.size(), velocity);
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) rest.x[at(i)] = setup.body.rest_position(i);
  }
  rest.removed.clear();
  rest.debris.clear();
  rest.clusters.rotation.assign(at(state.clusters.count()), Mat3{});
  rest.impulse = {};
  rest.skin = {};
  return rest;
}

// Takes one substep from rest with this velocity, in which `free` says what acts, and expects the body to move rigidly.
Verdict throw_body(const Relation& relation, Backend& backend, const Setup& setup, const State& given, Vec3 velocity,
                   void (*free)(StepParameters&), bool also_velocities, fmt::format_string<int32_t&, double&> text) {
  const State state = in_arithmetic_of(backend, given);
  return judge_relation(relation, backend, step_span(backend), setup, state, [&](Verdict& verdict) {
    if (setup.frame_count() == 0) return vacuous(verdict, "the schedule has no frames");
    Setup one = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
    free(one.step);
    const double h = setup.body.grid.spacing, dt = one.substep_length[0];
    const State start = at_rest(one, state, velocity);
    State moved = start;
    for (Vec3& v : moved.v) v += dt * one.step.gravity;
    for (std::size_t i = 0; i < moved.x.size(); ++i) moved.x[i] += dt * moved.v[i];
    const State end = after(backend, one, start, step_span(backend));
    ErrorNorm error = position_error(one, moved.x, end.x, start.alive);
    if (also_velocities) {  // they are differences of positions over dt
      ErrorNorm velocities = velocity_error(one, moved.v, end.v, dt, start.alive);
      velocities.max /= 2;
      error.join(velocities);
    }
    verdict.measured = error.max;
    verdict.bound = substep_rounding(one, moved) / h;
    verdict.checked = static_cast<int64_t>(std::count(start.alive.begin(), start.alive.end(), 1));
    if (!(error.max <= verdict.bound)) fail(verdict, {{}, {error.where}}, text, error.where, error.max);
  });
}

}  // namespace

Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& state) {
  const Relation relation = {"rest is fixed", "h", "tolerances.md, One substep", "nothing is alive"};
  const auto calm = [](StepParameters& step) { step.gravity = {}; };
  return throw_body(relation, backend, setup, state, {}, calm, false,
                    "particle {} of the rest state moves by {} h in one substep");
}

Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& state, Vec3 velocity) {
  const Relation relation = {"translation is exact", "h", "tolerances.md, One substep", "nothing is alive"};
  const auto undamped = [](StepParameters& step) { step.damping = 0; };
  return throw_body(relation, backend, setup, state, velocity, undamped, true,
                    "particle {} of a body that is thrown ends {} h from where it should");
}

}  // namespace cutproof::oracles
