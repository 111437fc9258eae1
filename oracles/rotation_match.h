// Whether the rotation of a cluster fits where its particles are: the best one, or as far from that as a step may leave
// it. Any set of particles can be asked about, also one that is no cluster of a state (the cluster that was split).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "model/vec.h"
#include "oracles/best_rotation.h"

namespace cutproof::oracles {

struct WeightedRest;  // oracles/shape_sums.h

// Greatest distance of a rotation from the best one for the judged places.
enum class Lag {
  none,   // nothing but rounding
  a_step  // half a right angle: it was taken before a step, or an iteration, that moved the particles
};

// The rotation that the particles of a cluster determine.
struct ShapeMatrix {
  Mat3 a;               // A = Σ w (x − t)(X − T)ᵀ [kg m²]
  double rounding = 0;  // greatest difference of A from the backend's A, in the Frobenius norm [kg m²]
};
// Requires particles that `rest` and x have, and finite numbers. `place_rounding`: State::place_rounding [m].
ShapeMatrix shape_matrix(const WeightedRest& rest, std::span<const int32_t> particles, const std::vector<Vec3>& x,
                         double unit_roundoff, double place_rounding);

struct RotationMatch {
  double gap = 0;           // (best value of tr(RᵀA) − this rotation's) / Σσ, in [0, 2]
  double bound = 0;         // on the gap (tolerances.md, Rotations of a state)
  double turn = 0;          // angle to a best rotation, the nearest one where A has rank one [rad]
  bool determined = false;  // false: any rotation is within the bound, so nothing was asked
  bool holds() const { return !determined || gap <= bound; }
};
// Requires R finite.
RotationMatch match_rotation(const ShapeMatrix& shape, const Mat3& r, double unit_roundoff, Lag lag);

// A name for a rotation that is not the best one, as the end of a sentence: "; its transpose is the best one", or that
// it is the identity; "" if it has no name.
std::string known_confusion(const BestRotation& best, const Mat3& r);

}  // namespace cutproof::oracles
