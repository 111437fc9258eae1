// Skin (method.md §8): marching cubes on the background grid, its vertices carried by the clusters.
#include <algorithm>
#include <array>
#include <vector>

#include "model/at.h"
#include "reference_cpu/reference.h"
#include "reference_cpu/skin_cases.h"

namespace cutproof::reference {
namespace {

// --- Extraction -------------------------------------------------------------------------------------------------

// Vertices are ordered by owner, then direction; triangles by the cell's lowest node, then as in the case table.
void extract(const Body& body, const std::vector<uint8_t>& alive, Skin& skin) {
  skin = {};
  const auto is_tissue = [&](int32_t p) { return p >= 0 && alive[static_cast<std::size_t>(p)] != 0; };

  std::vector<int32_t> vertex(static_cast<std::size_t>(body.particle_count()) * 6, -1);  // by owner and direction
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (int direction = 0; direction < 6 && is_tissue(p); ++direction) {
      if (is_tissue(body.neighbour(p, direction))) continue;
      vertex[static_cast<std::size_t>(p) * 6 + static_cast<std::size_t>(direction)] =
          static_cast<int32_t>(skin.owner.size());
      skin.owner.push_back(p);
      skin.direction.push_back(static_cast<uint8_t>(direction));
    }
  }
  skin.position.resize(skin.owner.size());

  const Grid& grid = body.grid;
  std::vector<uint8_t> tissue(static_cast<std::size_t>(grid.node_count()), 0);  // by node
  for (std::size_t p = 0; p < body.node.size(); ++p) tissue[static_cast<std::size_t>(body.node[p])] = alive[p] != 0;
  std::array<int64_t, 8> corner_step = {};
  for (int c = 0; c < 8; ++c) corner_step[static_cast<std::size_t>(c)] = grid.index(c & 1, c >> 1 & 1, c >> 2 & 1);
  for (int32_t k = 0; k + 1 < grid.nodes[2]; ++k) {
    for (int32_t j = 0; j + 1 < grid.nodes[1]; ++j) {
      for (int32_t i = 0; i + 1 < grid.nodes[0]; ++i) {
        const int64_t lowest = grid.index(i, j, k);
        const auto corner = [&](int c) {
          return static_cast<std::size_t>(lowest + corner_step[static_cast<std::size_t>(c)]);
        };
        int inside = 0;
        for (int c = 0; c < 8; ++c) inside |= tissue[corner(c)] << c;
        const auto vertex_on = [&](int cell_edge) {
          const CellEdge& edge = cell_edges()[static_cast<std::size_t>(cell_edge)];
          const bool low_owns = (inside >> edge.low & 1) != 0;
          const auto owner = static_cast<std::size_t>(body.particle_at[corner(low_owns ? edge.low : edge.high)]);
          return vertex[owner * 6 + static_cast<std::size_t>(2 * edge.axis + (low_owns ? 0 : 1))];
        };
        for (const auto& [a, b, c] : skin_cases()[static_cast<std::size_t>(inside)].triangles) {
          skin.triangles.push_back({vertex_on(a), vertex_on(b), vertex_on(c)});
        }
      }
    }
  }
}

// --- Positions --------------------------------------------------------------------------------------------------

// t_c: where the weighted centre of each cluster is now, with the weights w_ic = m_i / n_i.
std::vector<Vec3> current_centers(const Body& body, const State& state, const Memberships& memberships) {
  std::vector<Vec3> centers(static_cast<std::size_t>(state.clusters.count()));
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    double mass = 0;
    Vec3 moment;
    for (const int32_t i : state.clusters.of(c)) {
      const double weight = body.mass[static_cast<std::size_t>(i)] / static_cast<double>(memberships.count(i));
      mass += weight;
      moment += weight * state.x[static_cast<std::size_t>(i)];
    }
    centers[static_cast<std::size_t>(c)] = moment / mass;
  }
  return centers;
}

void place_vertices(const Setup& setup, State& state) {
  const Body& body = setup.body;
  const Memberships memberships = memberships_of(state.clusters, body.particle_count());
  const std::vector<Vec3> centers = current_centers(body, state, memberships);
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    const int32_t owner = state.skin.owner[v];
    const int direction = state.skin.direction[v];
    const double crossing = body.crossing(owner, direction);
    const double reach = (crossing > 0 ? crossing : setup.skin.alpha) * body.grid.spacing;
    const auto& e = kDirections[at(direction)];
    const Vec3 offset = {reach * e[0], reach * e[1], reach * e[2]};
    const Vec3 rest = body.rest_position(owner) + offset;
    Vec3 sum;
    for (const int32_t cluster : memberships.of(owner)) {
      const auto c = static_cast<std::size_t>(cluster);
      sum += centers[c] + state.clusters.rotation[c] * (rest - state.clusters.rest_center[c]);
    }
    // An owner without a cluster breaks I2. Its vertex then goes with the particle, unrotated.
    const auto count = memberships.count(owner);
    state.skin.position[v] =
        count > 0 ? sum / static_cast<double>(count) : state.x[static_cast<std::size_t>(owner)] + offset;
  }
}

}  // namespace

void skin(const Setup& setup, State& state) {
  if (!setup.skin.wanted) {
    state.skin = {};
    return;
  }
  const bool changed = !state.removed.empty() || !state.debris.empty();
  if (changed || state.skin.owner.empty()) extract(setup.body, state.alive, state.skin);
  place_vertices(setup, state);
}

}  // namespace cutproof::reference
