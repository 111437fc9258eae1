// What one frame of the step stage must keep: linear momentum, and rotations that are rotations.
#include <fmt/format.h>

#include <cmath>

#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// ‖RᵀR − I‖, Frobenius.
double orthogonality_defect(const Mat3& r) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double entry = i == j ? -1 : 0;
      for (int row = 0; row < 3; ++row) entry += r(row, i) * r(row, j);
      sum += entry * entry;
    }
  }
  return std::sqrt(sum);
}

double determinant(const Mat3& r) {
  return dot({r(0, 0), r(0, 1), r(0, 2)}, cross({r(1, 0), r(1, 1), r(1, 2)}, {r(2, 0), r(2, 1), r(2, 2)}));
}

struct Sums {
  double mass = 0;
  Vec3 momentum;
  double magnitude = 0;  // Σ m |v|
};

Sums sums_of(const Body& body, const State& state, const std::vector<uint8_t>& alive) {
  Sums sums;
  for (std::size_t i = 0; i < alive.size(); ++i) {
    if (!alive[i]) continue;
    sums.mass += body.mass[i];
    sums.momentum += body.mass[i] * state.v[i];
    sums.magnitude += body.mass[i] * norm(state.v[i]);
  }
  return sums;
}

}  // namespace

// p is damped with v and gains M g dt in each substep; contacts, pins and grips give J, which the state adds up with
// the same damping. So p after S substeps is D^S p + M g dt (D + … + D^S) + I, with D = e^(−c dt).
Verdict momentum(const Setup& setup, const State& before, const State& after) {
  Verdict verdict = start_verdict("linear momentum", after, "kg m/s", "docs/tolerances.md, Linear momentum");
  for (const State* state : {&before, &after}) {
    const Verdict form = well_formed(setup, *state);
    if (!form.holds) return not_judged(verdict.property, form);
  }
  if (before.frame < 0 || before.frame >= setup.frame_count()) return verdict;  // the timetable is over: vacuous
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
  // Every evaluation of a goal position may be off by one goal rounding, each new velocity by the rounding of its
  // difference of positions over dt, and all sums by their length. The impulse of a backend is such a sum as well.
  RoundingScale scale = rounding_scale(setup, before);
  const RoundingScale later = rounding_scale(setup, after);
  scale.extent = std::max(scale.extent, later.extent);
  const double per_substep = (step.iterations + 1.0) * goal_rounding(scale) / dt;
  const double sums = (static_cast<double>(verdict.checked) + 8.0 * step.substeps) * kUnitRoundoff *
                      (start.magnitude + end.magnitude + gained + norm(after.impulse));
  verdict.bound = step.substeps * start.mass * per_substep + 2 * sums;
  if (!(verdict.measured <= verdict.bound)) {
    verdict.holds = false;
    verdict.witness.text = fmt::format(
        "the frame began with momentum ({}, {}, {}), gravity and contacts account for ({}, {}, {}) at its end, and it "
        "is ({}, {}, {}) kg m/s",
        start.momentum.x, start.momentum.y, start.momentum.z, expected.x, expected.y, expected.z, end.momentum.x,
        end.momentum.y, end.momentum.z);
  }
  return verdict;
}

Verdict rotation_quality(const Setup& setup, const State& state) {
  // In whatever precision a backend computes.
  constexpr double kMostDefect = 5e-6;
  Verdict verdict = start_verdict("rotation", state, "1", "accuracy_and_speed.md §3");
  const Verdict form = well_formed(setup, state);
  if (!form.holds) return not_judged(verdict.property, form);
  verdict.bound = kMostDefect;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    const Mat3& r = state.clusters.rotation[at(c)];
    const double defect = orthogonality_defect(r);
    ++verdict.checked;
    const bool reflects = !(determinant(r) > 0);
    if (!(defect <= verdict.measured)) verdict.measured = defect;
    if (!verdict.holds || (defect <= kMostDefect && !reflects)) continue;
    const int32_t number = state.clusters.number[at(c)];
    verdict.holds = false;
    verdict.witness.clusters = {number};
    verdict.witness.text =
        reflects && defect <= kMostDefect
            ? fmt::format("the rotation of cluster {} is a reflection: its determinant is {}", number, determinant(r))
            : fmt::format("the rotation of cluster {} is off by {} from an orthogonal matrix", number, defect);
  }
  return verdict;
}

}  // namespace cutproof::oracles
