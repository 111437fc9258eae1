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

}  // namespace

std::optional<SolverError> solver_error(Backend& judged, const Setup& setup, const State& state) {
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
  const SubstepAnswer answer = substep_answer(one, start);
  error.solved_by = answer.by;
  error.converged = answer.converged;
  error.elsewhere = answer.elsewhere;

  // The backend and the solution begin at the same state, as the backend holds it, which may be rounded.
  const State end = after_frame(judged, one, start);
  error.position = measurable(one, end) ? position_error(one, answer.x, end.x, start.alive) : infinite_error();
  const double least = answer.energy;
  if (answer.by == SolvedBy::minimum && least > 0 && std::isfinite(error.position.max)) {
    error.energy = (substep_energy(one, start, end.x) - least) / least;
  }
  return error;
}

}  // namespace cutproof::oracles
