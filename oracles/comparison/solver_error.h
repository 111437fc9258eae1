// The error that is left because a solver stops iterating. Figures, not verdicts:
// docs/guide.md, Solver says what each of them means and what it does not. Lengths are in h, the spacing of the
// grid; what is broken or not a number is infinitely wrong.
#pragma once
#include <cstdint>
#include <optional>

#include "model/backend.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

// What one substep of a backend is held against.
enum class SolvedBy : uint8_t {
  minimum,   // the minimiser of E where contacts let it be (oracles/comparison/reference_solution.h)
  rest,      // the place of rest that the same solver finds where nothing is minimised: friction, or a particle that
             // blade and walls move in turn
  iteration  // the fixed point of the iteration of `exact`: with 64, 128, … kMostIterations iterations, until twice as
             // many change no position by more than kFixedPoint. Independent of nothing.
};
constexpr const char* name_of(SolvedBy by) {
  constexpr const char* kNames[] = {"minimum", "rest", "iteration"};
  return kNames[static_cast<int>(by)];
}
inline constexpr int32_t kMostIterations = 4096;
inline constexpr double kFixedPoint = 1e-9;  // [h]

// With a blade in the tissue or friction there may be several places of rest, and the reference solution is that to
// which the plain iteration leads (method.md §3): the solver's counts where plain iterations, written down apart from
// every backend (plain_limit), come within kFixedPoint of it.
struct SolverError {
  ErrorNorm position;            // of the alive particles [h]
  std::optional<double> energy;  // (E − E*) / E* [1]; absent where nothing is minimised, or E* is 0
  SolvedBy solved_by = SolvedBy::iteration;
  bool converged = false;  // the solution was found within its tolerance
  // Set where the solver rests, and plain iterations elsewhere.
  struct Elsewhere {
    double distance = 0;  // greatest of a particle [h]
    double energy = 0;    // (E there − E where plain iterations end) / E where they end [1]
  };
  std::optional<Elsewhere> elsewhere;
};
// The first substep of frame state.frame; nothing after the end of the schedule, nor with Solver::published, whose
// iteration has no limit but a rigid body (method.md §3). Loads both backends.
std::optional<SolverError> solver_error(Backend& judged, Backend& exact, const Setup& setup, const State& state);

}  // namespace cutproof::oracles
