// A body at rest: where its particles are, which of them are joined, and how heavy they are. Constant once made. Most
// bodies are nodes of a regular grid; one that is given as a graph alone (a bare graph) has no grid, and no skin.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "model/grid.h"

namespace cutproof {

// The other ends of the edges at one particle. A particle of a grid has at most six, which are kept here.
class Neighbours {
 public:
  const int32_t* begin() const { return more_.empty() ? few_.data() : more_.data(); }
  const int32_t* end() const { return begin() + count_; }
  int64_t size() const { return static_cast<int64_t>(count_); }
  void add(int32_t particle) {
    if (count_ == few_.size()) more_.assign(few_.begin(), few_.end());
    if (count_ < few_.size()) {
      few_[count_] = particle;
    } else {
      more_.push_back(particle);
    }
    ++count_;
  }

 private:
  std::array<int32_t, 6> few_;
  std::vector<int32_t> more_;  // all of them, where there are more than six
  std::size_t count_ = 0;
};

// Unit of a crossing along a grid edge, and the least and greatest crossing: a vertex on a node would make triangles
// without area.
inline constexpr int kCrossingSteps = 256, kLeastCrossing = kCrossingSteps / 16,
                     kGreatestCrossing = kCrossingSteps - kLeastCrossing;

struct Body {
  std::string name;  // "kidney", or the mesh's file name
  // Of a bare graph without nodes; the spacing is h all the same: the given one, or the longest edge at rest.
  Grid grid;
  std::vector<int64_t> node;  // [n] particle -> node, strictly ascending; no particle on the outer ring of nodes. Of a
                              // bare graph empty.
  std::vector<int32_t> particle_at;  // [grid.node_count()] node -> particle, or -1. Says nothing of alive or dead.
  // Only of a bare graph; of a body on a grid all three are empty.
  std::vector<Vec3> rest;             // [n] X_i [m]
  std::vector<int64_t> edge_offsets;  // [n + 1] those of particle i: edge_ends[edge_offsets[i] .. edge_offsets[i + 1])
  std::vector<int32_t> edge_ends;     // their other ends: each edge at both of its ends, none twice, none to itself
  std::vector<double> mass;           // [n] m_i > 0 [kg]
  // [6 n], or empty. Crossing of the body's surface with a grid edge from particle i to a node without a particle. The
  // distance from i is surface_crossing[6 i + direction] / 256 h, within 1/16 and 15/16; 0: not known.
  std::vector<uint8_t> surface_crossing;
  // Body frame to world: x_world = orientation · x + origin. Everything a backend sees is in the body frame,
  // so a body far from the world's origin computes with the same bits (method.md §1).
  Vec3 origin;       // [m], double precision, fixed at load
  Mat3 orientation;  // rotation

  bool on_grid() const { return edge_offsets.empty(); }
  int32_t particle_count() const { return static_cast<int32_t>(on_grid() ? node.size() : rest.size()); }
  Vec3 rest_position(int32_t particle) const {
    const auto i = static_cast<std::size_t>(particle);
    return on_grid() ? grid.rest_position(node[i]) : rest[i];
  }
  // Length of the edge between two neighbours at rest [m].
  double rest_length(int32_t a, int32_t b) const {
    return on_grid() ? grid.spacing : norm(rest_position(a) - rest_position(b));
  }
  // Distance from `particle` to the surface along that edge, as a fraction of h; 0: not known, or the edge stays
  // inside.
  double crossing(int32_t particle, int direction) const {
    if (surface_crossing.empty()) return 0;
    return surface_crossing[6 * static_cast<std::size_t>(particle) + static_cast<std::size_t>(direction)] /
           double{kCrossingSteps};
  }
  // The particle at the other end of the grid edge that leaves `particle` along kDirections[direction], or -1. Requires
  // a grid.
  int32_t neighbour(int32_t particle, int direction) const {
    return particle_at[static_cast<std::size_t>(node[static_cast<std::size_t>(particle)] + grid.step(direction))];
  }
  // The other ends of a particle's edges, dead or alive: on a grid in the order of kDirections, else as they are given.
  Neighbours neighbours(int32_t particle) const {
    const auto i = static_cast<std::size_t>(particle);
    Neighbours found;
    if (!on_grid()) {
      const auto first = static_cast<std::size_t>(edge_offsets[i]), end = static_cast<std::size_t>(edge_offsets[i + 1]);
      for (std::size_t k = first; k < end; ++k) found.add(edge_ends[k]);
      return found;
    }
    const int64_t row = grid.nodes[0], layer = row * grid.nodes[1];
    for (const int64_t step : {int64_t{1}, int64_t{-1}, row, -row, layer, -layer}) {
      if (const int32_t other = particle_at[static_cast<std::size_t>(node[i] + step)]; other >= 0) found.add(other);
    }
    return found;
  }
};

}  // namespace cutproof
