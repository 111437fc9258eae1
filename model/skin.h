// The visible surface: marching cubes on the background grid, with each vertex bound to a particle
// (method.md §8; paper §2.1 after Berndt et al. 2017).
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "model/vec.h"

namespace cutproof {

struct Skin {
  std::vector<int32_t> owner;      // [v] the alive particle whose grid edge carries the vertex
  std::vector<uint8_t> direction;  // [v] index into kDirections: from the owner to the empty end
  std::vector<double> reach;       // [v] how far from its owner it lies on that edge at rest [h], in (0, 1)
  std::vector<Vec3> position;      // [v] current position, body frame [m]
  std::vector<std::array<int32_t, 3>> triangles;  // [t] vertex indices, counter-clockwise seen from outside

  friend bool operator==(const Skin&, const Skin&) = default;
};

}  // namespace cutproof
