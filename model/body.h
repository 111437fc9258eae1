// A body at rest: which nodes of the grid are tissue, and how heavy they are. Constant once made.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "model/grid.h"

namespace cutproof {

struct Body {
  std::string name;  // "kidney", or the mesh's file name
  Grid grid;
  std::vector<int64_t> node;         // [n] particle -> node, strictly ascending; no particle on the outer ring of nodes
  std::vector<int32_t> particle_at;  // [grid.node_count()] node -> particle, or -1. Says nothing of alive or dead.
  std::vector<double> mass;          // [n] m_i > 0 [kg]
  // Body frame to world: x_world = orientation · x + origin. Everything a backend sees is in the body frame,
  // so a body far from the world's origin computes with the same bits (method.md §1).
  Vec3 origin;       // [m], double precision, fixed at load
  Mat3 orientation;  // rotation

  int32_t particle_count() const { return static_cast<int32_t>(node.size()); }
  Vec3 rest_position(int32_t particle) const { return grid.rest_position(node[static_cast<std::size_t>(particle)]); }
  // The particle at the other end of the grid edge that leaves `particle` along kDirections[direction], or -1.
  int32_t neighbour(int32_t particle, int direction) const {
    return particle_at[static_cast<std::size_t>(node[static_cast<std::size_t>(particle)] + grid.step(direction))];
  }
};

}  // namespace cutproof
