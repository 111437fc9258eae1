// Skin (method.md §8): marching cubes on the background grid, its vertices carried by the clusters.
#include <algorithm>
#include <array>
#include <vector>

#include "reference_cpu/reference.h"

namespace cutproof::reference {
namespace {

// --- The 256 cases, derived from two rules --------------------------------------------------------------------
//
// Corner c of a cell is the node (x, y, z) = bits 0, 1, 2 of c away from the cell's lowest node. Case: bit c is set
// if corner c is inside, that is, tissue. The twelve grid edges of a cell are numbered by axis, then by lower corner.

struct CellEdge {
  int low, high;  // corners; high = low with the bit of `axis` set
  int axis;
};

constexpr std::array<CellEdge, 12> cell_edges() {
  std::array<CellEdge, 12> edges = {};
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 8; ++corner) {
      if ((corner >> axis & 1) == 0) edges[next++] = {corner, corner | 1 << axis, axis};
    }
  }
  return edges;
}
constexpr auto kCellEdges = cell_edges();

constexpr int edge_between(int a, int b) {
  for (int e = 0; e < 12; ++e) {
    const CellEdge& edge = kCellEdges[static_cast<std::size_t>(e)];
    if ((edge.low == a && edge.high == b) || (edge.low == b && edge.high == a)) return e;
  }
  return -1;
}

// Corners of each face, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<int, 4>, 6> cell_faces() {
  std::array<std::array<int, 4>, 6> faces = {};
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, high = 1 << axis;
    faces[static_cast<std::size_t>(2 * axis)] = {high, high | u, high | u | v, high | v};  // normal + axis
    faces[static_cast<std::size_t>(2 * axis + 1)] = {0, v, u | v, u};                      // normal - axis
  }
  return faces;
}
constexpr auto kCellFaces = cell_faces();

constexpr bool on_one_face(int edge_a, int edge_b) {
  const CellEdge& a = kCellEdges[static_cast<std::size_t>(edge_a)];
  const CellEdge& b = kCellEdges[static_cast<std::size_t>(edge_b)];
  const int all_set = a.low & a.high & b.low & b.high, any_set = a.low | a.high | b.low | b.high;
  return all_set != 0 || any_set != 7;  // some coordinate is the same at all four ends
}

// Rule 1: for each crossed edge the crossed edge that follows it in its polygon; -1 for edges that are not crossed.
// On each face the contour runs round every run of inside corners, from where the boundary of the face enters it to
// where it leaves it. So two inside corners of an ambiguous face are separated, and a polygon is counter-clockwise
// seen from outside the tissue.
std::array<int, 12> contour(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kCellFaces) {
    const auto corner = [&](std::size_t k) { return face[k % 4]; };
    const auto is_inside = [&](std::size_t k) { return (inside >> corner(k) & 1) != 0; };
    for (std::size_t k = 0; k < 4; ++k) {
      if (is_inside(k) || !is_inside(k + 1)) continue;
      std::size_t last = k + 1;
      while (is_inside(last + 1)) ++last;
      next[static_cast<std::size_t>(edge_between(corner(k), corner(k + 1)))] =
          edge_between(corner(last), corner(last + 1));
    }
  }
  return next;
}

// Rule 2: a polygon is fanned from its first vertex, counted from its lowest edge, whose diagonals never join two
// vertices of one face. A diagonal inside a face could meet the same diagonal of the cell beyond it.
std::size_t fan_start(const std::vector<int>& polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t start = 0; start < n; ++start) {
    bool fits = true;
    for (std::size_t k = 2; k + 1 < n; ++k) fits = fits && !on_one_face(polygon[start], polygon[(start + k) % n]);
    if (fits) return start;
  }
  return n;  // never happens: a test goes through all 256 cases
}

using CellTriangles = std::vector<std::array<int, 3>>;  // cell edges

CellTriangles triangles_of_case(int inside) {
  CellTriangles triangles;
  const std::array<int, 12> next = contour(inside);
  std::array<bool, 12> done = {};
  for (int first = 0; first < 12; ++first) {
    std::vector<int> polygon;
    for (int e = first; next[static_cast<std::size_t>(e)] >= 0 && !done[static_cast<std::size_t>(e)];
         e = next[static_cast<std::size_t>(e)]) {
      done[static_cast<std::size_t>(e)] = true;
      polygon.push_back(e);
    }
    if (polygon.empty()) continue;
    const std::size_t n = polygon.size(), start = fan_start(polygon);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      triangles.push_back({polygon[start % n], polygon[(start + k) % n], polygon[(start + k + 1) % n]});
    }
  }
  return triangles;
}

const std::array<CellTriangles, 256>& case_table() {
  static const std::array<CellTriangles, 256> table = [] {
    std::array<CellTriangles, 256> cases;
    for (int inside = 0; inside < 256; ++inside) cases[static_cast<std::size_t>(inside)] = triangles_of_case(inside);
    return cases;
  }();
  return table;
}

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
  std::array<int64_t, 8> corner_step = {};
  for (int c = 0; c < 8; ++c) corner_step[static_cast<std::size_t>(c)] = grid.index(c & 1, c >> 1 & 1, c >> 2 & 1);
  for (int32_t k = 0; k + 1 < grid.nodes[2]; ++k) {
    for (int32_t j = 0; j + 1 < grid.nodes[1]; ++j) {
      for (int32_t i = 0; i + 1 < grid.nodes[0]; ++i) {
        std::array<int32_t, 8> corner = {};
        int inside = 0;
        for (std::size_t c = 0; c < 8; ++c) {
          corner[c] = body.particle_at[static_cast<std::size_t>(grid.index(i, j, k) + corner_step[c])];
          if (is_tissue(corner[c])) inside |= 1 << c;
        }
        const auto vertex_on = [&](int cell_edge) {
          const CellEdge& edge = kCellEdges[static_cast<std::size_t>(cell_edge)];
          const bool low_owns = (inside >> edge.low & 1) != 0;
          const auto owner =
              static_cast<std::size_t>(corner[static_cast<std::size_t>(low_owns ? edge.low : edge.high)]);
          return vertex[owner * 6 + static_cast<std::size_t>(2 * edge.axis + (low_owns ? 0 : 1))];
        };
        for (const auto& [a, b, c] : case_table()[static_cast<std::size_t>(inside)]) {
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
  const double reach = setup.skin.alpha * body.grid.spacing;
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    const int32_t owner = state.skin.owner[v];
    const auto& e = kDirections[state.skin.direction[v]];
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
