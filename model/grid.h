// The regular background grid (method.md §1; paper §2.2.1).
#pragma once
#include <array>
#include <cstdint>

#include "model/vec.h"

namespace cutproof {

// The six directions of a grid edge, and of a skin vertex from its owner. d ^ 1 is the opposite of d.
inline constexpr std::array<std::array<int, 3>, 6> kDirections = {
    {{+1, 0, 0}, {-1, 0, 0}, {0, +1, 0}, {0, -1, 0}, {0, 0, +1}, {0, 0, -1}}};

struct Grid {
  std::array<int32_t, 3> nodes = {0, 0, 0};  // count of nodes along x, y, z, the ring of empty nodes included
  double spacing = 0;                        // h [m]

  int64_t node_count() const { return int64_t{nodes[0]} * nodes[1] * nodes[2]; }
  int64_t index(int32_t i, int32_t j, int32_t k) const { return i + int64_t{nodes[0]} * (j + int64_t{nodes[1]} * k); }
  std::array<int32_t, 3> coordinates(int64_t node) const {
    const int64_t row = node / nodes[0];
    return {static_cast<int32_t>(node % nodes[0]), static_cast<int32_t>(row % nodes[1]),
            static_cast<int32_t>(row / nodes[1])};
  }
  // Step in the linear index along kDirections[direction]. Particles never lie on the outer ring of nodes, so
  // node + step(direction) stays inside the grid for each of them.
  int64_t step(int direction) const {
    const auto& d = kDirections[static_cast<std::size_t>(direction)];
    return d[0] + int64_t{nodes[0]} * (d[1] + int64_t{nodes[1]} * d[2]);
  }
  // Rest position of a node relative to the body's origin [m]: h · (i, j, k).
  Vec3 rest_position(int64_t node) const {
    const auto c = coordinates(node);
    return {spacing * c[0], spacing * c[1], spacing * c[2]};
  }
  friend bool operator==(const Grid&, const Grid&) = default;
};

}  // namespace cutproof
