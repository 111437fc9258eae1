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

// Whether there may be several places of rest.
bool may_rest_elsewhere(const Setup& setup, const State& state) {
  const auto has_friction = [](const Wall& wall) { return wall.friction > 0; };
  if (std::any_of(setup.walls.begin(), setup.walls.end(), has_friction)) return true;
  return setup.has_blade && setup.detect.criterion != Criterion::geometric &&
         setup.blade_moves[at(state.frame * setup.step.substeps)].down;
}

struct Solution {
  std::vector<Vec3> x;
  bool converged = false;
  SolvedBy by = SolvedBy::iteration;
  double energy = 0;  // of a minimum
  std::optional<SolverError::Elsewhere> elsewhere = {};
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

Solution solution_of(Backend& exact, const Setup& setup, const State& state) {
  ReferenceSolution rest = reference_solution(setup, state);
  const SolvedBy by = rest.is_minimum ? SolvedBy::minimum : SolvedBy::rest;
  if (!may_rest_elsewhere(setup, state)) {
    return {.x = std::move(rest.x), .converged = rest.converged, .by = SolvedBy::minimum, .energy = rest.energy};
  }
  const PlainLimit limit = plain_limit(setup, state, kFixedPoint / 1000, kMostIterations);
  const double apart = position_error(setup, rest.x, limit.x, state.alive).max;
  if (rest.converged && apart <= kFixedPoint) {
    return {.x = std::move(rest.x), .converged = true, .by = by, .energy = rest.energy};
  }
  Solution solution = fixed_point(exact, setup, state);
  if (rest.converged && limit.last_change <= kFixedPoint) {
    const double end = limit.energy.back();
    solution.elsewhere = {apart, end > 0 ? (rest.energy - end) / end : 0};
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
  const Solution solution = solution_of(exact, one, start);
  error.solved_by = solution.by;
  error.converged = solution.converged;
  error.elsewhere = solution.elsewhere;

  // What is judged begins where the solution does: at the state as the backend holds it, which may be rounded.
  const State end = after_frame(judged, one, start);
  error.position = measurable(one, end) ? position_error(one, solution.x, end.x, start.alive) : infinite_error();
  const double least = solution.energy;
  if (solution.by == SolvedBy::minimum && least > 0 && std::isfinite(error.position.max)) {
    error.energy = (substep_energy(one, start, end.x) - least) / least;
  }
  return error;
}

}  // namespace cutproof::oracles
