// Skin (method.md §8): marching cubes on the background grid; clusters carry the vertices.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/at.h"
#include "reference_cpu/carrier.h"
#include "reference_cpu/lowered_blade.h"
#include "reference_cpu/reference.h"
#include "reference_cpu/skin_cases.h"

namespace cutproof::reference {
namespace {

// --- Extraction -------------------------------------------------------------------------------------------------

// The edge of a vertex: 6 · owner + direction.
std::size_t edge_of(int32_t owner, int direction) { return at(owner) * 6 + at(direction); }

// Vertices are ordered by owner, then direction; triangles by the cell's lowest node, then as in the case table.
void extract(const Body& body, const std::vector<uint8_t>& alive, Skin& skin) {
  skin = {};
  const auto is_tissue = [&](int32_t p) { return p >= 0 && alive[static_cast<std::size_t>(p)] != 0; };

  std::vector<int32_t> vertex(static_cast<std::size_t>(body.particle_count()) * 6, -1);  // by owner and direction
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (int direction = 0; direction < 6 && is_tissue(p); ++direction) {
      if (is_tissue(body.neighbour(p, direction))) continue;
      vertex[edge_of(p, direction)] = static_cast<int32_t>(skin.owner.size());
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
          const int32_t owner = body.particle_at[corner(low_owns ? edge.low : edge.high)];
          return vertex[edge_of(owner, 2 * edge.axis + (low_owns ? 0 : 1))];
        };
        for (const auto& [a, b, c] : skin_cases()[static_cast<std::size_t>(inside)].triangles) {
          skin.triangles.push_back({vertex_on(a), vertex_on(b), vertex_on(c)});
        }
      }
    }
  }
}

// --- Positions --------------------------------------------------------------------------------------------------

// Distance of a new cut vertex from its owner, as a fraction of h. `owner`, `end`: signed heights over the blade's
// plane to which the owner's clusters carry the ends of the grid edge [h]. The vertex goes where the edge crosses the
// plane, within [1/16, 15/16], because it stays on its edge. It comes nearer to alpha the farther the plane is from the
// edge, or the flatter the edge lies to it. Continuity makes rounding move the vertex and decide nothing (method.md
// §8).
double cut_reach(double owner, double end, double alpha) {
  constexpr double kLeast = double{kLeastCrossing} / kCrossingSteps, kGreatest = 1 - kLeast;
  constexpr double kFlat = 0.25;           // sine of the angle below which an edge counts less and less
  const double t = owner / (owner - end);  // position on the edge, from the owner
  if (!(t > -1 && t < 3)) return alpha;    // also if it is parallel to the plane
  const double crossing = t < 0   ? kLeast - t * (alpha - kLeast)
                          : t > 2 ? kGreatest + (t - 2) * (alpha - kGreatest)
                                  : std::clamp(t, kLeast, kGreatest);
  return alpha + std::min(1.0, std::abs(owner - end) / kFlat) * (crossing - alpha);
}

// Existing vertices keep their places on their edges. Vertices beside particles that died in this frame go where the
// blade crosses their edges. The body gives the places of all others.
void find_reaches(const Setup& setup, const Skin& before, const Carrier& carried, State& state) {
  const Body& body = setup.body;
  Skin& skin = state.skin;
  std::vector<double> known(at(body.particle_count()) * 6, 0);
  for (std::size_t v = 0; v < before.owner.size(); ++v) {
    known[edge_of(before.owner[v], before.direction[v])] = before.reach[v];
  }
  std::vector<uint8_t> died(at(body.particle_count()), 0);
  for (const auto* list : {&state.removed, &state.debris}) {
    for (const int32_t i : *list) died[at(i)] = 1;
  }
  const BladePose* const blade = setup.skin.fit_cuts ? lowered_blade(setup, state.frame) : nullptr;
  skin.reach.clear();
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const int direction = skin.direction[v];
    const int32_t end = body.neighbour(owner, direction);
    double reach = known[edge_of(owner, direction)];
    if (reach == 0 && blade != nullptr && end >= 0 && died[at(end)]) {
      const Vec3 normal = cross(blade->along, blade->back);
      const auto height = [&](double part) {
        return dot(carried(owner, direction, part) - blade->edge, normal) / body.grid.spacing;
      };
      reach = cut_reach(height(0), height(1), setup.skin.alpha);
    } else if (reach == 0) {
      const double crossing = body.crossing(owner, direction);
      reach = crossing > 0 ? crossing : setup.skin.alpha;
    }
    skin.reach.push_back(reach);
  }
}

}  // namespace

void skin(const Setup& setup, State& state) {
  if (!setup.skin.wanted) {
    state.skin = {};
    return;
  }
  const bool changed = !state.removed.empty() || !state.debris.empty();
  const Carrier carried(setup, state);
  if (changed || state.skin.owner.empty()) {
    const Skin before = state.skin;
    extract(setup.body, state.alive, state.skin);
    find_reaches(setup, before, carried, state);
  }
  Skin& skin = state.skin;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    skin.position[v] = carried(skin.owner[v], skin.direction[v], skin.reach[v]);
  }
}

}  // namespace cutproof::reference
