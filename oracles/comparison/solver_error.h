// The error of a solver that stops after finitely many iterations. Figures, not verdicts (measure_and_tune.md, Solver).
// Lengths are in h, the spacing of the grid; broken data and NaN have an infinite error.
#pragma once
#include <optional>

#include "model/backend.h"
#include "oracles/comparison/error_norm.h"
#include "oracles/comparison/reference_solution.h"

namespace cutproof::oracles {

// One substep of a backend against the answer of the same substep (oracles/comparison/reference_solution.h), which
// shares nothing with a backend.
struct SolverError {
  ErrorNorm position;            // of the alive particles [h]
  std::optional<double> energy;  // (E − E*) / E* [1]; absent where nothing is minimised, or E* is 0
  SolvedBy solved_by = SolvedBy::iteration;
  bool converged = false;  // the answer was found within its tolerance
  std::optional<SubstepAnswer::Elsewhere> elsewhere;
};
// The first substep of frame state.frame; nothing after the end of the schedule, nor with Solver::published, whose
// iteration has no limit but a rigid body (method.md §3). Loads the backend.
std::optional<SolverError> solver_error(Backend& judged, const Setup& setup, const State& state);

}  // namespace cutproof::oracles
