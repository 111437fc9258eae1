#include "oracles/comparison/solver_error.h"

#include <algorithm>
#include <cmath>

#include "oracles/comparison/measurable.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/single_substep.h"
#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

State after_frame(Backend& backend, const Setup& setup, const State& state) {
  constexpr Span kStep{Stage::step, Stage::step};
  backend.load({setup}, {state});
  backend.run(backend.can_run(kStep) ? kStep : Span{});
  return std::move(backend.snapshot().front());
}

// Whether reference_solution takes the first substep of the state's frame.
bool has_energy(const Setup& setup, const State& state) {
  const auto has_friction = [](const Wall& wall) { return wall.friction > 0; };
  if (std::any_of(setup.walls.begin(), setup.walls.end(), has_friction)) return false;
  return !setup.has_blade || setup.detect.criterion == Criterion::geometric ||
         !setup.blade_moves[at(state.frame * setup.step.substeps)].down;
}

struct Solution {
  std::vector<Vec3> x;
  bool converged = false;
};

Solution fixed_point(Backend& exact, Setup setup, const State& state) {
  Solution solution;
  for (setup.step.iterations = 64; setup.step.iterations <= kMostIterations; setup.step.iterations *= 2) {
    std::vector<Vec3> x = after_frame(exact, setup, state).x;
    solution.converged = !solution.x.empty() && position_error(setup, solution.x, x, state.alive).max <= kFixedPoint;
    solution.x = std::move(x);
    if (solution.converged) break;
  }
  return solution;
}

}  // namespace

std::optional<SolverError> solver_error(Backend& judged, Backend& exact, const Setup& setup, const State& state) {
  if (state.frame >= setup.frame_count() || setup.step.solver != Solver::implicit) return std::nullopt;
  Setup one = single_substep_setup(setup, state.frame);
  one.detect.without_blade = false;
  State start = state;
  start.frame = 0;

  SolverError error;
  if (!measurable(setup, state)) {
    error.position = infinite_error();
    return error;
  }
  error.by_energy = has_energy(one, start);
  Solution solution;
  double least = 0;
  if (error.by_energy) {
    ReferenceSolution minimiser = reference_solution(one, start);
    solution = {std::move(minimiser.x), minimiser.converged};
    least = minimiser.energy;
  } else {
    solution = fixed_point(exact, one, start);
  }
  error.converged = solution.converged;

  // What is judged begins where the solution does: at the state as the backend holds it, which may be rounded.
  const State end = after_frame(judged, one, start);
  error.position = measurable(one, end) ? position_error(one, solution.x, end.x, start.alive) : infinite_error();
  if (error.by_energy && least > 0 && std::isfinite(error.position.max)) {
    error.energy = (substep_energy(one, start, end.x) - least) / least;
  }
  return error;
}

}  // namespace cutproof::oracles
