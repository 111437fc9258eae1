#include "reference_cpu/skin_cases.h"

namespace cutproof::reference {
namespace {

std::array<CellEdge, 12> number_cell_edges() {
  std::array<CellEdge, 12> edges = {};
  std::size_t next = 0;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if ((corner >> axis & 1) == 0) edges[next++] = {corner, corner | 1 << axis, axis};
    }
  }
  return edges;
}

int edge_between(int a, int b) {
  for (std::size_t e = 0; e < 12; ++e) {
    const CellEdge& edge = cell_edges()[e];
    if ((edge.low == a && edge.high == b) || (edge.low == b && edge.high == a)) return static_cast<int>(e);
  }
  return -1;
}

// Corners of each face, counter-clockwise seen from outside the cell.
std::array<std::array<int, 4>, 6> face_corners() {
  std::array<std::array<int, 4>, 6> faces = {};
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, high = 1 << axis;
    faces[static_cast<std::size_t>(2 * axis)] = {high, high | u, high | u | v, high | v};  // normal along +axis
    faces[static_cast<std::size_t>(2 * axis + 1)] = {0, v, u | v, u};                      // normal along -axis
  }
  return faces;
}

// Rule 1: the next crossed edge of each crossed edge's polygon; -1 for edges that are not crossed. On each face the
// contour goes round every run of inside corners, from where the border enters the run to where it leaves it. So the
// two inside corners of an ambiguous face are separated.
std::array<int, 12> contour(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : face_corners()) {
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

// Rule 2: a polygon is fanned from its first vertex, from its lowest edge on, whose diagonals never join two vertices
// of one face. The cell beyond that face could have the same diagonal, and so an edge with four triangles.
std::size_t find_fan_start(const std::vector<int>& polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t start = 0; start < n; ++start) {
    bool fits = true;
    for (std::size_t k = 2; k + 1 < n; ++k) fits = fits && !on_one_face(polygon[start], polygon[(start + k) % n]);
    if (fits) return start;
  }
  return n;  // never happens: a test goes through all 256 cases
}

SkinCase derive(int inside) {
  SkinCase result;
  const std::array<int, 12> next = contour(inside);
  std::array<bool, 12> done = {};
  for (int lowest = 0; lowest < 12; ++lowest) {
    std::vector<int> polygon;
    for (auto e = static_cast<std::size_t>(lowest); next[e] >= 0 && !done[e]; e = static_cast<std::size_t>(next[e])) {
      done[e] = true;
      polygon.push_back(static_cast<int>(e));
    }
    if (polygon.empty()) continue;
    const std::size_t n = polygon.size(), start = find_fan_start(polygon);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      result.triangles.push_back({polygon[start % n], polygon[(start + k) % n], polygon[(start + k + 1) % n]});
    }
    result.polygons.push_back(std::move(polygon));
    result.fan_start.push_back(start);
  }
  return result;
}

}  // namespace

const std::array<CellEdge, 12>& cell_edges() {
  static const std::array<CellEdge, 12> edges = number_cell_edges();
  return edges;
}

bool on_one_face(int edge_a, int edge_b) {
  const CellEdge& a = cell_edges()[static_cast<std::size_t>(edge_a)];
  const CellEdge& b = cell_edges()[static_cast<std::size_t>(edge_b)];
  // All four ends share a bit (coordinate).
  return (a.low & a.high & b.low & b.high) != 0 || (a.low | a.high | b.low | b.high) != 7;
}

const std::array<SkinCase, 256>& skin_cases() {
  static const std::array<SkinCase, 256> cases = [] {
    std::array<SkinCase, 256> all;
    for (std::size_t inside = 0; inside < 256; ++inside) all[inside] = derive(static_cast<int>(inside));
    return all;
  }();
  return cases;
}

}  // namespace cutproof::reference
