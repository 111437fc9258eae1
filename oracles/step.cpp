// What one frame of the step stage must keep: linear momentum.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {
namespace {

struct Sums {
  double mass = 0;
  Vec3 momentum;
  double magnitude = 0;  // Σ m |v|
};

// Summed in extended precision, so that only the rounding of what is judged is left.
Sums sums_of(const Body& body, const State& state, const std::vector<uint8_t>& alive) {
  long double mass = 0, x = 0, y = 0, z = 0, magnitude = 0;
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (!alive[i]) continue;
    const long double m = body.mass[i];
    mass += m;
    x += m * state.v[i].x;
    y += m * state.v[i].y;
    z += m * state.v[i].z;
    magnitude += m * norm(state.v[i]);
  }
  const auto rounded = [](long double value) { return static_cast<double>(value); };
  return {rounded(mass), {rounded(x), rounded(y), rounded(z)}, rounded(magnitude)};
}

// Root of the sum of squares of the clusters' and of the particles' masses: how independent errors of goal positions
// and of single positions add up in the momentum (tolerances.md, Linear momentum).
struct IndependentMasses {
  double clusters = 0, particles = 0;
};

IndependentMasses independent_masses(const Body& body, const State& state) {
  const std::vector<int32_t> counts = membership_counts(state.clusters, body.particle_count());
  IndependentMasses sums;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    double mass = 0;
    for (const int32_t i : state.clusters.of(c)) mass += weight_of(body, counts, i);
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
  const Sums start = sums_of(setup.body, before, before.alive);
  const Sums end = sums_of(setup.body, after, before.alive);

  Vec3 expected = start.momentum;
  double gained = 0;
  for (int32_t s = 0; s < step.substeps; ++s) {
    expected = decay * (expected + (start.mass * dt) * step.gravity);
    gained += start.mass * dt * norm(step.gravity);
  }
  expected += after.impulse;

  verdict.measured = norm(end.momentum - expected);
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
  verdict.bound =
      kLambda * (evaluations * goal * step_length / dt +
                 sums * unit_roundoff(after) * (start.magnitude + end.magnitude + gained + norm(after.impulse)));
  if (!(verdict.measured <= verdict.bound)) {
    verdict.holds = false;
    verdict.witness.text = fmt::format(
        "the frame began with momentum ({}, {}, {}), gravity and contacts account for ({}, {}, {}) at its end, and it "
        "is ({}, {}, {}) kg m/s",
        start.momentum.x, start.momentum.y, start.momentum.z, expected.x, expected.y, expected.z, end.momentum.x,
        end.momentum.y, end.momentum.z);
  }
}

}  // namespace cutproof::oracles
