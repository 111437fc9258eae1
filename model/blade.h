// The blade: a thin rounded box that moves along a path (method.md §3, Blade).
#pragma once
#include <cstdint>
#include <vector>

#include "model/vec.h"

namespace cutproof {

// The blade is the set of points within thickness / 2 of its mid-surface, a rectangle of length × depth.
struct Blade {
  double length = 0;     // along the cutting edge [m], > 0
  double depth = 0;      // from the cutting edge to the back [m], > 0
  double thickness = 0;  // [m], >= 0
  double friction = 0;   // Coulomb coefficient against tissue, >= 0

  friend bool operator==(const Blade&, const Blade&) = default;
};

// The mid-surface is { edge + u·along + w·back : |u| <= length / 2, 0 <= w <= depth }. Its positive normal is along ×
// back.
struct BladePose {
  Vec3 edge;               // middle of the cutting edge, body frame [m]
  Vec3 along = {1, 0, 0};  // unit, direction of the cutting edge
  Vec3 back = {0, 0, 1};   // unit, orthogonal to `along`: from the cutting edge to the back

  friend bool operator==(const BladePose&, const BladePose&) = default;
};

// Motion of the blade in one substep. Between `from` and `to` the middle of the edge moves on a straight line and the
// orientation turns about one axis, both at a constant rate. A raised blade (not down) touches nothing.
struct BladeMove {
  BladePose from, to;
  bool down = false;
  int32_t stroke = -1;  // which stroke of the path, from 0; -1 between strokes

  friend bool operator==(const BladeMove&, const BladeMove&) = default;
};

}  // namespace cutproof
