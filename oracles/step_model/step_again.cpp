// A step beside the same step computed again (tolerances.md, The step again).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oracles/best_rotation.h"
#include "oracles/checks.h"
#include "oracles/step_model/admissible_step.h"

namespace cutproof::oracles {

namespace {

// Whether σ2 + σ3 of the matrix of cluster c, whose members may be off by `off` [m], is above every threshold. A
// singular value changes by at most the change of the matrix, and σ1 is at least |A| / √3.
bool is_unique(const StepOutcome& outcome, int32_t c, double off, double u) {
  const Mat3& a = outcome.shape[at(c)];
  double squares = 0;
  for (const double entry : a.m) squares += entry * entry;
  const double change = std::sqrt(3.0 / squares) * outcome.arms[at(c)] * off;  // in units of σ1
  return best_rotation(a).separation > 3 * change + degenerate_rounds(u) * u;
}

// Whether each cluster's flag tells whether its rotation is unique (method.md §3). Without iterations flags keep their
// values. Where rounding or a backend's threshold decides, both values are accepted.
void check_flags(const Setup& setup, const State& before, const State& after, const AdmissibleStep& step,
                 std::span<const RotationKnown> known_rotations, Verdict& verdict) {
  const StepOutcome& outcome = step.outcome;
  // With retardation rotations are those of places that are extrapolated by τ / dt.
  const double stretch = 1 + setup.step.retardation / setup.substep_length[at(before.frame)];
  const Clusters& clusters = after.clusters;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    if (!known_rotations.empty() && known_rotations[at(c)] != RotationKnown::yes) continue;
    const bool says = clusters.degenerate[at(c)] != 0, said = before.clusters.degenerate[at(c)] != 0;
    const int32_t number = before.clusters.number[at(c)];
    if (outcome.is_thin.empty()) {
      if (says != said)
        fail(verdict, {{number}}, "no iteration has looked at cluster {}, but its flag changed", number);
    } else if (outcome.is_thin[at(c)] != 0) {
      // In single precision a sum rounds by as much as the least threshold that a backend has.
      if (!says && after.precision == Precision::binary64)
        fail(verdict, {{number}}, "cluster {} lies on a line at rest, but is not marked as not unique", number);
    } else if (says) {
      double off = 0;  // [h]
      for (const int32_t i : clusters.of(c)) off = std::max(off, step.position_bound[at(i)]);
      if (!is_unique(outcome, c, off * stretch * setup.body.grid.spacing, unit_roundoff(after))) continue;
      fail(verdict, {{number}}, "the rotation of cluster {} is the only best one, but is marked as not unique", number);
    }
    if (!verdict.holds) return;
  }
}

}  // namespace

StepAgain step_again(const Setup& setup, const State& before, const State& after,
                     std::span<const RotationKnown> known_rotations) {
  Verdict verdict = start_verdict(kAdmissibleStep, after, "h", kAdmissibleStepSource);
  const auto done = [&] { return StepAgain{conclude(std::move(verdict), kNoStep)}; };
  const Clusters &was = before.clusters, &is = after.clusters;
  if (before.frame < 0 || before.frame >= setup.frame_count()) {
    verdict.vacuous = "the schedule is over";
    return done();
  }
  if (was.offsets != is.offsets || was.members != is.members || before.alive != after.alive) {
    fail(verdict, {}, "the step has changed what is alive, or which clusters there are");
    return done();
  }
  if (!std::all_of(before.x.begin(), before.x.end(), is_finite) ||
      !std::all_of(before.v.begin(), before.v.end(), is_finite)) {
    verdict.vacuous = "the step began with numbers that are not finite";
    return done();
  }
  StepAgain again;
  again.step = nearest_admissible_step(setup, before, after, known_rotations);
  const AdmissibleStep& step = *again.step;
  verdict.measured = step.measured;
  verdict.bound = step.bound;
  verdict.checked = step.checked;
  verdict.inconclusive = step.inconclusive;
  if (!step.holds) {
    Concerned concerned;
    std::string whose;
    if (step.part == StepPart::rotation) {
      concerned.clusters = {was.number[at(step.where)]};
      whose = fmt::format(" of cluster {}", concerned.clusters.front());
    } else if (step.part != StepPart::impulse) {
      concerned.particles = {step.where};
      whose = fmt::format(" of particle {}", step.where);
    }
    fail(verdict, concerned, "the {}{} is {:.3g} h from where an admissible step ends, rounding explains {:.3g} h",
         name_of(step.part), whose, step.measured, step.bound);
  } else if (!step.outcome.x.empty()) {
    check_flags(setup, before, after, step, known_rotations, verdict);
  }
  again.verdict = conclude(std::move(verdict), kNoStep);
  return again;
}

void check_admissible_step(const StageRun& run, Verdict& verdict) {
  verdict = step_again(run.setup, run.before, run.after, run.known_rotations).verdict;
}

}  // namespace cutproof::oracles
