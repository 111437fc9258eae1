// The 256 cases of a grid cell, derived in code from the two rules of method.md §8.
//
// Corner c of a cell is the node (x, y, z) = (bit 0, bit 1, bit 2 of c) from the cell's lowest node. In case k corner c
// is inside (tissue) if bit c of k is set. A polygon's vertices lie on the cell's twelve grid edges, numbered by lower
// corner, then by axis.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace cutproof::reference {

struct CellEdge {
  int low, high;  // corners; `high` is one step along `axis` from `low`
  int axis;
};
const std::array<CellEdge, 12>& cell_edges();

// Whether one of the cell's six faces contains both edges.
bool on_one_face(int edge_a, int edge_b);

struct SkinCase {
  // Closed polygons of cell edges, counter-clockwise seen from outside the tissue, each beginning with its lowest edge,
  // ordered by lowest edge; and the position where each polygon's fan begins.
  std::vector<std::vector<int>> polygons;
  std::vector<std::size_t> fan_start;
  // The fans, polygon after polygon, as cell edges.
  std::vector<std::array<int, 3>> triangles;
};
// Computed once, at the first call.
const std::array<SkinCase, 256>& skin_cases();

}  // namespace cutproof::reference
