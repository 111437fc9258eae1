// The error that is left because a solver stops iterating. Figures, not verdicts:
// docs/guide.md, Solver says what each of them means and what it does not. Lengths are in h, the spacing of the
// grid; what is broken or not a number is infinitely wrong.
#pragma once
#include <optional>

#include "model/backend.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

// One substep of a backend against the reference solution of the same substep, which is
// - where the substep minimises an energy (Solver::implicit, no blade in the tissue, no friction): the minimiser, by
//   sparse Cholesky factorisation (oracles/comparison/reference_solution.h);
// - otherwise the fixed point of the same iteration: that of `exact`, with 64, 128, … kMostIterations iterations, until
//   twice as many change no position by more than kFixedPoint.
inline constexpr int32_t kMostIterations = 4096;
inline constexpr double kFixedPoint = 1e-9;  // [h]
struct SolverError {
  ErrorNorm position;            // of the alive particles [h]
  std::optional<double> energy;  // (E − E*) / E* [1]; absent where there is no energy, or E* is 0
  bool by_energy = false;        // the solution is the minimiser
  bool converged = false;        // the solution was found within its tolerance
};
// The first substep of frame state.frame; nothing after the end of the schedule, nor with Solver::published, whose
// iteration has no limit but a rigid body (method.md §3). Loads both backends.
std::optional<SolverError> solver_error(Backend& judged, Backend& exact, const Setup& setup, const State& state);

}  // namespace cutproof::oracles
