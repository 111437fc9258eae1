// The 256 cases of a grid cell (docs/design/method.md §8), derived by the compiler from the section's rules.
//
// Corner c of a cell is the node (bit 0, bit 1, bit 2 of c) away from the cell's lowest node. In case k corner c is
// tissue if bit c of k is set. The twelve cell edges are numbered by their lower corner, then by axis.
#pragma once
#include "gpu/launch/block.h"

namespace cutproof::gpu {

inline constexpr int kMostSkinTriangles = 5;  // of a cell; proved below

struct SkinTable {
  signed char low[12] = {};                               // lower corner of a cell edge
  signed char axis[12] = {};                              // its direction; the upper corner is low + (1 << axis)
  signed char corners[256][3 * kMostSkinTriangles] = {};  // triangles as cell edges, outward; -1: none
  int most_triangles = 0;                                 // of any case
  bool complete = true;                                   // every polygon closed and fanned, every crossed edge used
};

namespace skin_detail {

// Whether one of the cell's six faces contains both edges.
CUTPROOF_BOTH constexpr bool share_face(const SkinTable& table, int a, int b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == table.axis[a] || axis == table.axis[b]) continue;
    if ((table.low[a] >> axis & 1) == (table.low[b] >> axis & 1)) return true;
  }
  return false;
}

CUTPROOF_BOTH constexpr int edge_between(const SkinTable& table, int a, int b) {
  const int low = a < b ? a : b, high = a < b ? b : a;
  for (int e = 0; e < 12; ++e) {
    if (table.low[e] == low && low + (1 << table.axis[e]) == high) return e;
  }
  return -1;
}

// The position where the fan of a polygon of cell edges begins: the first vertex whose diagonals never join two
// vertices of one cell face; -1: none.
CUTPROOF_BOTH constexpr int fan_start(const SkinTable& table, const int* polygon, int size) {
  for (int start = 0; start < size; ++start) {
    bool legal = true;
    for (int k = 2; k + 1 < size; ++k) {
      if (share_face(table, polygon[start], polygon[(start + k) % size])) legal = false;
    }
    if (legal) return start;
  }
  return -1;
}

// For each crossed edge of case `inside` the next one of its polygon; -1 for the others. Faces are walked
// counter-clockwise, seen from outside the cell. The contour runs from where the walk enters tissue to where it leaves
// it. So on an ambiguous face each of the two inside corners is separate. Polygons are counter-clockwise seen from
// outside the tissue.
CUTPROOF_BOTH constexpr void link_edges(const SkinTable& table, int inside, int* next) {
  for (int e = 0; e < 12; ++e) next[e] = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
    for (int side = 0; side < 2; ++side) {
      const int base = side << axis;
      // Counter-clockwise about +axis; the lower face is seen from the other side.
      const int walk[4] = {base, base + (side ? u : v), base + u + v, base + (side ? v : u)};
      for (int k = 0; k < 4; ++k) {
        const bool enters = !(inside >> walk[k] & 1) && (inside >> walk[(k + 1) % 4] & 1);
        if (!enters) continue;
        int last = (k + 1) % 4;
        while (inside >> walk[(last + 1) % 4] & 1) last = (last + 1) % 4;
        next[edge_between(table, walk[k], walk[(k + 1) % 4])] = edge_between(table, walk[last], walk[(last + 1) % 4]);
      }
    }
  }
}

CUTPROOF_BOTH constexpr void add_case(SkinTable& table, int inside) {
  int next[12] = {};
  link_edges(table, inside, next);
  bool used[12] = {};
  int triangles = 0;
  for (int lowest = 0; lowest < 12; ++lowest) {
    if (next[lowest] < 0 || used[lowest]) continue;
    int polygon[12] = {}, size = 0;
    for (int e = lowest; e >= 0 && !used[e]; e = next[e]) {
      used[e] = true;
      polygon[size++] = e;
    }
    const int start = fan_start(table, polygon, size);
    if (next[polygon[size - 1]] != lowest || size < 3 || start < 0) {
      table.complete = false;
      return;
    }
    for (int k = 1; k + 1 < size; ++k, ++triangles) {
      if (triangles >= kMostSkinTriangles) continue;  // counted, and refused below
      const int corner[3] = {polygon[start], polygon[(start + k) % size], polygon[(start + k + 1) % size]};
      for (int c = 0; c < 3; ++c) table.corners[inside][3 * triangles + c] = static_cast<signed char>(corner[c]);
    }
  }
  if (triangles > table.most_triangles) table.most_triangles = triangles;
  for (int e = 0; e < 12; ++e) {
    const int low = table.low[e], high = low + (1 << table.axis[e]);
    if (used[e] != ((inside >> low & 1) != (inside >> high & 1))) table.complete = false;
  }
}

}  // namespace skin_detail

CUTPROOF_BOTH constexpr SkinTable make_skin_table() {
  SkinTable table;
  int edges = 0;
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) {
      if (corner >> axis & 1) continue;
      table.low[edges] = static_cast<signed char>(corner);
      table.axis[edges++] = static_cast<signed char>(axis);
    }
  }
  for (int inside = 0; inside < 256; ++inside) {
    for (int c = 0; c < 3 * kMostSkinTriangles; ++c) table.corners[inside][c] = -1;
    skin_detail::add_case(table, inside);
  }
  return table;
}

// Computed by the compiler; in global memory on the device, because cells of a warp read different cases.
CUTPROOF_BOTH inline const SkinTable& skin_table() {
  static constexpr SkinTable table = make_skin_table();
  static_assert(table.complete, "A case of a grid cell has a polygon that is open or cannot be fanned.");
  static_assert(table.most_triangles == kMostSkinTriangles, "Cells hold another number of triangles than is kept.");
  return table;
}

}  // namespace cutproof::gpu
