// Volume and orientation of tetrahedra and of hexahedra in VTK's order of corners. Internal to oracles/runs/.
#pragma once
#include "model/vec.h"

namespace cutproof::oracles {

inline double volume_of(const Vec3* x) { return dot(x[1] - x[0], cross(x[2] - x[0], x[3] - x[0])) / 6; }
// A hexahedron is judged by the tetrahedra at its corners.
inline constexpr int kCornersOfHexahedron[8][4] = {{0, 1, 3, 4}, {1, 2, 0, 5}, {2, 3, 1, 6}, {3, 0, 2, 7},
                                                   {4, 7, 5, 0}, {5, 4, 6, 1}, {6, 5, 7, 2}, {7, 6, 4, 3}};

inline bool is_inverted(const Vec3* x, int corners) {
  if (corners == 4) return !(volume_of(x) > 0);
  for (const auto& corner : kCornersOfHexahedron) {
    const Vec3 tetrahedron[4] = {x[corner[0]], x[corner[1]], x[corner[2]], x[corner[3]]};
    if (!(volume_of(tetrahedron) > 0)) return true;
  }
  return false;
}
inline double size_of(const Vec3* x, int corners) {
  double size = 0;
  if (corners == 4) return volume_of(x);
  for (const auto& corner : kCornersOfHexahedron) {
    const Vec3 tetrahedron[4] = {x[corner[0]], x[corner[1]], x[corner[2]], x[corner[3]]};
    size += volume_of(tetrahedron) * 6 / 8;
  }
  return size;
}

}  // namespace cutproof::oracles
