// The best value of any rotation for a matrix A, max tr(Rᵀ A), by a singular value decomposition of A in extended
// precision (long double). A bound on its error follows from the residual.
#pragma once
#include <array>

#include "model/vec.h"

namespace cutproof::oracles {

// Results for A scaled by a power of two such that its greatest entry lies in [1/2, 1).
struct BestRotation {
  std::array<long double, 9> a;  // A scaled; row-major
  long double value = 0;         // σ1 + σ2 + s σ3, s the sign of det A
  long double sum = 0;           // σ1 + σ2 + σ3
  std::array<double, 3> sigma;   // descending
  double separation = 0;         // (σ2 + s σ3) / σ1: how well the best rotation is determined; at 0 it is not unique
  std::array<double, 3> u, v;    // A v = σ1 u
  Mat3 r;                        // a rotation that reaches it
  double error = 0;              // of value / sum
};

// Requires A finite and not zero.
BestRotation best_rotation(const Mat3& a);

// (value - tr(Rᵀ A)) / Σσ, in [-error, 2] for rotations. Requires R finite.
double objective_gap(const BestRotation& best, const Mat3& r);

// The rotation that takes v to u and is the nearest of those to P: P followed by the shortest turn. `weight` is cos² of
// half that turn: 0 where P v = -u and every such rotation is as near. Rounding grows by 1 / √weight.
struct NearestRotation {
  Mat3 r;
  double weight = 0;
};
NearestRotation nearest_of_rank_one(const BestRotation& best, const Mat3& p);

}  // namespace cutproof::oracles
