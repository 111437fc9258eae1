// What one frame of the step stage must keep: linear momentum.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/shape_sums.h"
#include "oracles/totals.h"

namespace cutproof::oracles {
namespace {

// Root of the sum of squares of the clusters' and of the particles' masses: how independent errors of goal positions
// and of single positions add up in the momentum (tolerances.md, Linear momentum).
struct IndependentMasses {
  double clusters = 0, particles = 0;
};

IndependentMasses independent_masses(const Body& body, const State& state) {
  const WeightedRest rest = weighted_rest(body, state.clusters);
  IndependentMasses sums;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    double mass = 0;
    for (const int32_t i : state.clusters.of(c)) mass += rest.weight[at(i)];
    sums.clusters += mass * mass;
  }
  for (std::size_t i = 0; i < body.mass.size(); ++i) {
    if (state.alive[i]) sums.particles += body.mass[i] * body.mass[i];
  }
  return {std::sqrt(sums.clusters), std::sqrt(sums.particles)};
}

}  // namespace

// p is damped with v and gains M g dt in each substep; contacts, pins and grips give J, which the state adds up with
// the same damping. So p after S substeps is D^S p + M g dt (D + … + D^S) + I, with D = e^(−c dt).
void check_momentum(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  if (before.frame < 0 || before.frame >= setup.frame_count()) {
    verdict.vacuous = "the schedule is over";
    return;
  }
  const StepParameters& step = setup.step;
  const double dt = setup.substep_length[static_cast<std::size_t>(before.frame)];
  const double decay = std::exp(-step.damping * dt);
  const Totals start = totals_of(setup.body, before, before.alive), end = totals_of(setup.body, after, before.alive);
  const Vec3 momentum_before = start.total_momentum(), momentum_after = end.total_momentum();
  const auto mass = static_cast<double>(start.mass);

  Vec3 expected = momentum_before;
  auto magnitude = static_cast<double>(start.speed) + static_cast<double>(end.speed);
  double gained = 0;
  for (int32_t s = 0; s < step.substeps; ++s) {
    expected = decay * (expected + (mass * dt) * step.gravity);
    gained += mass * dt * norm(step.gravity);
  }
  expected += after.impulse;
  magnitude += gained + norm(after.impulse);

  verdict.measured = norm(momentum_after - expected);
  verdict.checked = static_cast<int64_t>(std::count(before.alive.begin(), before.alive.end(), 1));
  // Rounding errors of one sum are taken as independent (Higham and Mary 2019): λ √n instead of n, wrong with
  // probability 2 exp(−λ² / 2) < 3e-14. Errors that stay the same from one iteration to the next (of T_c and M_c) are
  // not: they count linearly.
  constexpr double kLambda = 8;
  RoundingScale scale = rounding_scale(setup, before);
  const RoundingScale later = rounding_scale(setup, after);
  scale.unit_roundoff = std::max(scale.unit_roundoff, later.unit_roundoff);
  const IndependentMasses masses = independent_masses(setup.body, before);
  const double step_length = unit_roundoff(after) * std::max(scale.extent, later.extent);
  const double goal = std::sqrt(2.0 * static_cast<double>(scale.largest_cluster) + 16) * masses.clusters +
                      std::sqrt(scale.most_memberships + 16.0) * masses.particles;
  const double evaluations = step.substeps * (step.iterations + 1.0) * error_growth(step);
  const double sums = std::sqrt(static_cast<double>(verdict.checked) * evaluations) + 16 * step.substeps;
  verdict.bound = kLambda * (evaluations * goal * step_length / dt + sums * unit_roundoff(after) * magnitude);
  if (verdict.measured <= verdict.bound) return;
  const Vec3 p = momentum_before, q = momentum_after;
  fail(
      verdict, {},
      "the frame began with momentum ({}, {}, {}), gravity and contacts account for ({}, {}, {}) at its end, and it is "
      "({}, {}, {}) kg m/s",
      p.x, p.y, p.z, expected.x, expected.y, expected.z, q.x, q.y, q.z);
}

}  // namespace cutproof::oracles
