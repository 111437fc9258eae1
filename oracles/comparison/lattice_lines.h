// Lines parallel to an axis, through triangles, along which areas and volumes are integrated. Internal to
// oracles/comparison/.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "model/vec.h"
#include "oracles/support.h"

namespace cutproof::oracles {

using Triangle = std::array<Vec3, 3>;

// The two other axes, so that (axis, u, v) is right-handed.
struct Axes {
  int axis, u, v;
};
inline Axes axes_of(int axis) { return {axis, (axis + 1) % 3, (axis + 2) % 3}; }

// Where a line meets a triangle.
struct Crossing {
  int64_t line = 0;
  double at = 0;      // coordinate along the axis
  double normal = 0;  // component of the triangle's unit normal along the axis
};

// Lines at first + (k + ½) spacing, k = 0 .. count - 1, along u and along v.
struct Lattice {
  Axes axes = axes_of(0);
  std::array<double, 2> first = {};
  std::array<int64_t, 2> count = {};
  std::array<double, 2> spacing = {};

  double place(int which, int64_t k) const {
    return first[at(which)] + (static_cast<double>(k) + 0.5) * spacing[at(which)];
  }
};

// On which side of the directed edge from p to q the point c lies, in the plane: +1 left, -1 right. A point on the edge
// is taken to be moved by (ε, ε²), so that of two triangles at an edge exactly one has it. Evaluated the same way for
// both directions of an edge.
inline int side_of(std::array<double, 2> p, std::array<double, 2> q, std::array<double, 2> c) {
  const bool reversed = q < p;
  if (reversed) std::swap(p, q);
  const double dx = q[0] - p[0], dy = q[1] - p[1];
  const double value = dx * (c[1] - p[1]) - dy * (c[0] - p[0]);
  const int side = value > 0 ? 1 : value < 0 ? -1 : dy != 0 ? (dy > 0 ? -1 : 1) : (dx > 0 ? 1 : -1);
  return reversed ? -side : side;
}

// Calls `see` with every crossing of a triangle.
template <class See>
void cross_lines(const Lattice& lattice, const Triangle& triangle, const See& see) {
  const auto [axis, u, v] = lattice.axes;
  std::array<std::array<double, 2>, 3> corner;
  for (std::size_t k = 0; k < 3; ++k) corner[k] = {triangle[k][u], triangle[k][v]};
  const Vec3 normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const double area = norm(normal);
  if (!(area > 0) || normal[axis] == 0 || !std::isfinite(area)) return;
  const auto range = [&](std::size_t w) {
    const auto [low, high] = std::minmax({corner[0][w], corner[1][w], corner[2][w]});
    const auto line = [&](double x) { return (x - lattice.first[w]) / lattice.spacing[w] - 0.5; };
    const auto most = static_cast<double>(lattice.count[w]);
    return std::array<int64_t, 2>{static_cast<int64_t>(std::clamp(std::floor(line(low)), 0.0, most)),
                                  static_cast<int64_t>(std::clamp(std::ceil(line(high)) + 1, 0.0, most))};
  };
  const auto [u0, u1] = range(0);
  const auto [v0, v1] = range(1);
  for (int64_t j = v0; j < v1; ++j) {
    for (int64_t i = u0; i < u1; ++i) {
      const std::array<double, 2> c = {lattice.place(0, i), lattice.place(1, j)};
      const int side = side_of(corner[0], corner[1], c);
      if (side != side_of(corner[1], corner[2], c) || side != side_of(corner[2], corner[0], c)) continue;
      const double along =
          triangle[0][axis] - (normal[u] * (c[0] - corner[0][0]) + normal[v] * (c[1] - corner[0][1])) / normal[axis];
      see(Crossing{i + lattice.count[0] * j, along, normal[axis] / area});
    }
  }
}

}  // namespace cutproof::oracles
