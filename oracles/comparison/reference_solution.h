// The reference solution of one implicit substep (method.md §3), without its iteration: alternates between rotations
// and, for fixed rotations, the fixed point of x and t by sparse factorisation.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

struct ReferenceSolution {
  std::vector<Vec3> x;         // [n] where the substep comes to rest [m]; dead particles keep their position
  std::vector<Mat3> rotation;  // [m]
  double energy = 0;           // E(x) [kg m²/s²]
  int32_t alternations = 0;
  double last_change = 0;   // greatest change of a position in the last alternation [h]
  bool converged = false;   // last_change < 1e-12
  bool is_minimum = false;  // of E where contacts let x be, for its rotations: without friction, and no particle
                            // between blade and walls that are projected in turn
};

// The first substep of frame state.frame. Requires Solver::implicit and room between the walls (throws
// std::invalid_argument). With a blade or friction there may be several fixed points: the first plain iterations choose
// one.
ReferenceSolution reference_solution(const Setup& setup, const State& state);

// Which answer of a substep counts (method.md §3), and how it was found.
enum class SolvedBy : uint8_t {
  minimum,   // reference_solution, a minimum of E where contacts let it be
  rest,      // reference_solution where nothing is minimised: friction, or a particle that blade and walls move in turn
  iteration  // plain iterations, because they end elsewhere, or it has found nothing
};
constexpr const char* name_of(SolvedBy by) {
  constexpr const char* kNames[] = {"minimum", "rest", "iteration"};
  return kNames[static_cast<int>(by)];
}
inline constexpr int64_t kMostIterations = 4096;
inline constexpr double kMeets = 1e-9;  // [h]

struct SubstepAnswer {
  std::vector<Vec3> x;         // [n] [m]
  std::vector<Mat3> rotation;  // [m]
  double energy = 0;           // E there [kg m²/s²]
  SolvedBy by = SolvedBy::iteration;
  bool converged = false;  // by iteration: kMostIterations were enough to change nothing by more than kMeets / 1000
  // Set where reference_solution rests, and plain iterations elsewhere.
  struct Elsewhere {
    double distance = 0;  // greatest of a particle [h]
    double energy = 0;    // (E there − E where plain iterations end) / E where they end [1]; 0 if that is 0
  };
  std::optional<Elsewhere> elsewhere;
};
// With a blade in the tissue or friction there may be several fixed points, and the answer is the limit of the plain
// iteration. The result of reference_solution counts if plain_limit comes within kMeets of it. Without blade and
// friction the minimum is the answer. Requirements as for reference_solution.
SubstepAnswer substep_answer(const Setup& setup, const State& state);

// E of method.md §3 at positions x, minimised over t and R: what `energy_is_monotone` compares. x~ is computed from
// the state; it is the free motion, before contacts: walls bound x, and held particles have no inertia. Blade and
// friction do not enter it. Throws if the solver is not implicit.
double substep_energy(const Setup& setup, const State& state, const std::vector<Vec3>& x);
// Its gradient with respect to x [N]: t and R being the best, m (x - x~) / dt² + k Σ_c w (x - t - R (X - T)), and with
// retardation (m (y - y~) / (dt (dt + τ)) + k Σ_c w (y - t - R (X - T))) (dt + τ) / dt.
std::vector<Vec3> substep_gradient(const Setup& setup, const State& state, const std::vector<Vec3>& x);

// The limit of the plain iteration, in double, implemented without reference_cpu/: iterates until the change is below
// `tolerance` · h or `most` iterations are done. With tolerance 0 exactly `most` are done. Throws as reference_solution
// does.
struct PlainLimit {
  std::vector<Vec3> x;
  std::vector<Mat3> rotation;
  std::vector<double> energy;          // after each iteration, from x~ on
  std::vector<double> momentum_drift;  // after each iteration: |Σ m (x − x~)| / Σ m |x~ − x_prev|
  int64_t iterations = 0;
  double last_change = 0;  // [h]
};
PlainLimit plain_limit(const Setup& setup, const State& state, double tolerance, int64_t most);

}  // namespace cutproof::oracles
