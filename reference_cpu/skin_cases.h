// The 256 cases of a grid cell, derived in code from the two rules of method.md §8.
//
// Corner c of a cell is the node (x, y, z) = (bit 0, bit 1, bit 2 of c) away from the cell's lowest node. In case k
// corner c is inside, that is tissue, if bit c of k is set. A polygon's vertices lie on the cell's twelve grid edges,
// which are numbered by lower corner, then by axis.
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

// Whether one of the six faces of the cell holds both edges.
bool on_one_face(int edge_a, int edge_b);

struct SkinCase {
  // Closed polygons of cell edges, counter-clockwise seen from outside the tissue, each from its lowest edge on, in
  // the order of their lowest edges; and for each the position in it that its fan starts from.
  std::vector<std::vector<int>> polygons;
  std::vector<std::size_t> fan_start;
  // The fans, polygon after polygon, as cell edges.
  std::vector<std::array<int, 3>> triangles;
};
// Computed once, at the first call.
const std::array<SkinCase, 256>& skin_cases();

}  // namespace cutproof::reference
