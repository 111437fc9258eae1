// Shells of the skin and cavities of the tissue, by joining what touches.
#include "oracles/shells.h"

#include <cstdlib>

namespace cutproof::oracles {

int32_t count_cavities(const Judged& judged) {
  const Grid& grid = judged.body.grid;
  const auto [nx, ny, nz] = grid.nodes;
  if (judged.body.particle_count() == 0) return 0;
  std::vector<uint8_t> empty(at(grid.node_count()), 1);
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i)) empty[at(judged.body.node[at(i)])] = 0;
  }
  // The half of the 18 neighbours that comes earlier in the linear index.
  std::vector<int64_t> earlier;
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int64_t step = di + int64_t{nx} * (dj + int64_t{ny} * dk);
        const int distance = std::abs(di) + std::abs(dj) + std::abs(dk);
        if (step < 0 && distance <= 2) earlier.push_back(step);
      }
    }
  }
  // Node 0 stands for the outside: every node of the ring, which are all empty, and all that touches it.
  DisjointSets sets(grid.node_count());
  const auto on_ring = [&](int32_t i, int32_t j, int32_t k) {
    return i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1;
  };
  for (int32_t k = 0; k < nz; ++k) {
    for (int32_t j = 0; j < ny; ++j) {
      for (int32_t i = 0; i < nx; ++i) {
        const auto node = static_cast<int32_t>(grid.index(i, j, k));
        if (empty[at(node)] == 0) continue;
        if (on_ring(i, j, k)) {
          sets.unite(0, node);
          continue;
        }
        for (const int64_t step : earlier) {
          if (empty[at(node + step)] != 0) sets.unite(node, static_cast<int32_t>(node + step));
        }
        if (i == nx - 2 || j == ny - 2 || k == nz - 2) sets.unite(0, node);
      }
    }
  }
  int32_t cavities = 0;
  for (int32_t node = 1; node < grid.node_count(); ++node) {
    if (empty[at(node)] != 0 && sets.find(node) == node) ++cavities;
  }
  return cavities;
}

Shells shells_of(const Skin& skin, const std::vector<Vec3>& points) {
  DisjointSets sets(static_cast<int64_t>(skin.owner.size()));
  std::vector<uint8_t> used(skin.owner.size(), 0);
  for (const auto& t : skin.triangles) {
    sets.unite(t[0], t[1]);
    sets.unite(t[0], t[2]);
    for (const int32_t v : t) used[at(v)] = 1;
  }
  Shells shells;
  shells.of_vertex.assign(skin.owner.size(), -1);
  int32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    const auto root = at(sets.find(static_cast<int32_t>(v)));
    shells.of_vertex[v] = root == v ? count++ : shells.of_vertex[root];
  }
  shells.volume.assign(at(count), 0.0);
  for (const auto& t : skin.triangles) {
    shells.volume[at(shells.of_vertex[at(t[0])])] += dot(points[at(t[0])], cross(points[at(t[1])], points[at(t[2])]));
  }
  return shells;
}

ShellCount count_shells(const Skin& skin) {
  ShellCount count;
  for (const double volume : shells_of(skin, skin.position).volume) (volume > 0 ? count.outer : count.inner) += 1;
  return count;
}

}  // namespace cutproof::oracles
