// The reference solution of one implicit substep (method.md §3), by CHOLMOD: for fixed rotations minimise E over x and
// t together, alternate with the rotations. With frictionless walls and pinned particles.
#pragma once
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

struct ReferenceSolution {
  std::vector<Vec3> x;         // [n] the minimiser [m]; dead particles keep their position
  std::vector<Mat3> rotation;  // [m]
  double energy = 0;           // E(x) [kg m²/s²]
  int32_t alternations = 0;
  double last_change = 0;  // greatest change of a position in the last alternation [h]
  bool converged = false;  // last_change < 1e-12
};

// The first substep of frame state.frame. Requires Solver::implicit; no blade down, no friction (throws
// std::invalid_argument).
ReferenceSolution reference_solution(const Setup& setup, const State& state);

// E of method.md §3 at positions x, minimised over t and R: what `energy_is_monotone` compares. x~ is computed from
// the state; it is the free motion, before contacts: walls bound x, and held particles have no inertia. Blade and
// friction do not enter it. Throws if the solver is not implicit.
double substep_energy(const Setup& setup, const State& state, const std::vector<Vec3>& x);
// Its gradient [N]: t and R being the best, m (x - x~) / dt² + k Σ_c w (x - t - R (X - T)).
std::vector<Vec3> substep_gradient(const Setup& setup, const State& state, const std::vector<Vec3>& x);

// The limit of the plain iteration, in double, written down a second time without reference_cpu/: iterates until the
// change is below `tolerance` · h or `most` iterations are done. With tolerance 0 exactly `most` are done. Throws as
// reference_solution does.
struct PlainLimit {
  std::vector<Vec3> x;
  std::vector<double> energy;          // after each iteration, from x~ on
  std::vector<double> momentum_drift;  // after each iteration: |Σ m (x − x~)| / Σ m |x~ − x_prev|
  int64_t iterations = 0;
  double last_change = 0;  // [h]
};
PlainLimit plain_limit(const Setup& setup, const State& state, double tolerance, int64_t most);

}  // namespace cutproof::oracles
