// The implicit solver never raises the energy of its substep.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/comparison/reference_solution.h"
#include "oracles/comparison/substep_problem.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"
#include "oracles/shape_sums.h"
#include "oracles/step_model/admissible_step.h"
#include "oracles/volume_target.h"

namespace cutproof::oracles {
namespace {

bool keeps_nearly_flat_cluster(const Setup& setup, const State& state) {
  if (setup.step.volume_share == 0) return false;
  const SubstepProblem problem(setup, state);
  return std::any_of(problem.moments.begin(), problem.moments.end(),
                     [](const Mat3& moments) { return volume_target(moments, moments, {}).is_nearly_flat; });
}

}  // namespace

Verdict energy_is_monotone(Backend& backend, const Setup& setup, const State& given, int32_t iterations) {
  const State state = in_arithmetic_of(backend, given);
  const Relation relation = {"energy is monotone", "J", "tolerances.md, Energy", "no iteration was run"};
  return judge_relation(relation, backend, step_span(backend), setup, state, [&](Verdict& verdict) {
    if (setup.step.solver != Solver::implicit) return vacuous(verdict, "only the implicit solver has an energy");
    if (state.frame >= setup.frame_count()) return vacuous(verdict, "the schedule is over");
    // Accelerated, only the first iteration is promised to lower it: that one is plain.
    if (setup.step.acceleration != Acceleration::none) iterations = std::min(iterations, 1);
    Setup single = single_substep_setup(setup, state.frame);
    const bool blade = single.has_blade && single.blade_moves[0].down && single.blade.friction > 0;
    const bool wall =
        std::any_of(single.walls.begin(), single.walls.end(), [](const Wall& w) { return w.friction > 0; });
    if (blade || wall) return vacuous(verdict, "friction has no energy");
    State start = state;
    start.frame = 0;
    if (keeps_nearly_flat_cluster(single, start)) {
      return vacuous(verdict, "the map of a cluster that is nearly flat is no minimum of an energy");
    }

    double mass = 0;
    for (std::size_t i = 0; i < state.alive.size(); ++i) mass += state.alive[i] != 0 ? single.body.mass[i] : 0;
    const double dt = single.substep_length[0], k = single.step.stiffness, ahead = dt + single.step.retardation;
    // Of E by x, for each unit of mass: it is quadratic in y, which moves (dt + τ) / dt times as far.
    const double curvature = (1 / (dt * ahead) + k) * (ahead / dt) * (ahead / dt);
    const auto terms = static_cast<double>(state.clusters.members.size() + state.x.size());
    // By how much rounding may move the energy of an iterate that it moves by b: Σ |∇E| b + κ / 2 Σ m b², κ as above.
    const auto rounding_of = [&](const std::vector<Vec3>& x, const std::vector<double>& bound) {
      const std::vector<Vec3> gradient = substep_gradient(single, start, x);
      double sum = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        if (state.alive[i] == 0) continue;
        const double off = bound[i] * single.body.grid.spacing;
        sum += norm(gradient[i]) * off + curvature * single.body.mass[i] * off * off / 2;
      }
      return sum;
    };
    double previous = 0, previous_rounding = 0, worst = -std::numeric_limits<double>::infinity();
    for (int32_t iteration = 0; iteration <= iterations; ++iteration) {
      single.step.iterations = iteration;
      const State end = after(backend, single, start, step_span(backend));
      const double energy = substep_energy(single, start, end.x);
      const StepAgain again = step_again(single, start, end);
      if (!again.step) return fail(verdict, {}, "{}", again.verdict.witness.text);
      const double rounding = rounding_of(end.x, again.step->position_bound);
      // The oracle's own, in double: of the residuals, which are differences of places, and of the sum.
      RoundingScale scale = rounding_scale(single, end);
      scale.extent = std::max(scale.extent, rounding_scale(single, start).extent);
      scale.unit_roundoff = kUnitRoundoff;
      const double rho = 2 * goal_rounding(scale);
      const double evaluation =
          rho * (ahead / dt) * (std::sqrt(2 * mass * energy / (dt * ahead)) + std::sqrt(2 * k * mass * energy)) +
          terms * kUnitRoundoff * energy;
      // E is isotropic in each particle: the allowed increase of a place.
      double raised = 0;
      for (std::size_t i = 0; i < end.x.size(); ++i) {
        if (state.alive[i] == 0) continue;
        raised += curvature / 2 * single.body.mass[i] * again.step->outcome.raised[i];
      }
      const double bound = previous_rounding + rounding + evaluation + raised;
      const double growth = iteration == 0 ? 0 : energy - previous;
      if (iteration > 0) ++verdict.checked;
      if (!(growth <= bound)) {
        verdict.measured = growth;
        verdict.bound = bound;
        return fail(verdict, {}, "iteration {} raises the energy of the substep from {} to {} J", iteration,
                    figure_beside(previous, energy), figure_beside(energy, previous));
      }
      if (iteration > 0 && growth / bound > worst) {
        worst = growth / bound;
        verdict.measured = std::max(0.0, growth);
        verdict.bound = bound;
      }
      previous = energy;
      previous_rounding = rounding;
    }
  });
}

}  // namespace cutproof::oracles
