// Shells of the skin and cavities of the tissue, by joining what touches.
#include "oracles/shells.h"

#include <cstdlib>

namespace cutproof::oracles {

int32_t count_cavities(const Judged& judged) {
  const Grid& grid = judged.body.grid;
  if (judged.body.particle_count() == 0) return 0;
  const auto count = static_cast<int32_t>(grid.node_count());
  std::vector<uint8_t> empty(at(count), 1);
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i)) empty[at(judged.body.node[at(i)])] = 0;
  }
  // The half of the 18 neighbours that comes earlier in the linear index.
  std::vector<int64_t> earlier;
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int64_t step = grid.index(di, dj, dk);
        if (step < 0 && std::abs(di) + std::abs(dj) + std::abs(dk) <= 2) earlier.push_back(step);
      }
    }
  }
  // A step that leaves the grid comes back to it on the other side: from one node of the outer ring to another. They
  // are all empty, and all belong to the outside, as node 0 does.
  DisjointSets sets(count);
  for (int32_t node = 0; node < count; ++node) {
    for (const int64_t step : earlier) {
      const int64_t other = node + step;
      if (other >= 0 && empty[at(node)] != 0 && empty[at(other)] != 0) sets.unite(node, static_cast<int32_t>(other));
    }
  }
  int32_t cavities = 0;
  for (int32_t node = 1; node < count; ++node) {
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
