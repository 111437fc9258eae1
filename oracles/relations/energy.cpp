// The implicit solver never raises the energy of its substep.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/comparison/reference_solution.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

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

    double mass = 0;
    for (std::size_t i = 0; i < state.alive.size(); ++i) mass += state.alive[i] ? single.body.mass[i] : 0;
    const double dt = single.substep_length[0], k = single.step.stiffness;
    const auto terms = static_cast<double>(state.clusters.members.size() + state.x.size());
    double previous = 0, worst = -std::numeric_limits<double>::infinity();
    for (int32_t iteration = 0; iteration <= iterations; ++iteration) {
      single.step.iterations = iteration;
      const State end = after(backend, single, start, step_span(backend));
      const double energy = substep_energy(single, start, end.x);
      RoundingScale scale = rounding_scale(single, start);
      scale.extent = std::max(scale.extent, rounding_scale(single, end).extent);
      const double rho = 2 * goal_rounding(scale);
      const double bound = rho * (std::sqrt(2 * mass * energy) / dt + std::sqrt(2 * k * mass * energy)) +
                           terms * scale.unit_roundoff * energy + mass * (1 / (dt * dt) + k) * rho * rho;
      const double growth = iteration == 0 ? 0 : energy - previous;
      if (iteration > 0) ++verdict.checked;
      if (!(growth <= bound)) {
        verdict.measured = growth;
        verdict.bound = bound;
        return fail(verdict, {}, "iteration {} raises the energy of the substep from {} to {} J", iteration, previous,
                    energy);
      }
      if (iteration > 0 && growth / bound > worst) {
        worst = growth / bound;
        verdict.measured = std::max(0.0, growth);
        verdict.bound = bound;
      }
      previous = energy;
    }
  });
}

}  // namespace cutproof::oracles
