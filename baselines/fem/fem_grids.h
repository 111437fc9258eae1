// Coarser grids for multigrid, on the host: cells of a finer grid in boxes of two an axis. What a cut has parted stays
// parted: a box has a coarse cell for each group of its cells that links join, and coarse cells share nodes where a
// link of the finer grid joins them across a face (Dick, Georgii and Westermann 2011, section 4).
#pragma once
#include "baselines/fem/fem_mesh.h"

namespace cutproof::baselines::fem {

struct Grid {
  std::vector<std::array<int32_t, 3>> place;    // [c] of its box
  std::vector<std::array<int32_t, 8>> corners;  // [c] nodes in VTK's order
  std::vector<std::array<int32_t, 2>> links;    // [l] cells, the lower one first
  std::size_t nodes = 0;
};

// `corners` [8 c]. Boxes are those of the first cell's edges; cells that do not fit them make a worse preconditioner,
// and no wrong one. Removed cells have no links.
inline Grid finest(const Mesh& mesh, const std::vector<int32_t>& corners, std::size_t nodes) {
  Grid grid;
  grid.nodes = nodes;
  Eigen::Matrix3d to_boxes = Eigen::Matrix3d::Identity();
  Vec3 origin = Vec3::Zero();
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    const Corners rest = corners_of(mesh.rest, mesh.cells[c]);
    if (c == 0) {
      for (int k = 0; k < 3; ++k) to_boxes.col(k) = rest.row(k == 0 ? 1 : k == 1 ? 3 : 4) - rest.row(0);
      to_boxes = to_boxes.inverse().eval();
      origin = rest.row(0);
    }
    const Vec3 at = to_boxes * (Vec3(rest.row(0)) - origin);
    auto& place = grid.place.emplace_back();
    for (int k = 0; k < 3; ++k) place[k] = static_cast<int32_t>(std::lround(std::clamp(at[k], -1e9, 1e9)));
    auto& of_cell = grid.corners.emplace_back();
    std::copy_n(corners.begin() + static_cast<std::ptrdiff_t>(8 * c), 8, of_cell.begin());
  }
  for (std::size_t l = 0; l < mesh.links.size(); ++l) {
    const auto [a, b] = mesh.links[l];
    if (mesh.is_cut[l] + mesh.is_removed[static_cast<std::size_t>(a)] + mesh.is_removed[static_cast<std::size_t>(b)] ==
        0)
      grid.links.push_back(mesh.links[l]);
  }
  return grid;
}

// `parent` [finer cells]: their coarse cell. Coarse cells are numbered as their first cells.
inline Grid coarser(const Grid& finer, std::vector<int32_t>& parent) {
  const auto box_of = [&](std::size_t c) {
    std::array<int32_t, 3> box = finer.place[c];
    for (int32_t& k : box) k = (k - (k & 1)) / 2;
    return box;
  };
  std::vector<std::array<int32_t, 2>> inside;
  for (const auto& link : finer.links) {
    if (box_of(static_cast<std::size_t>(link[0])) == box_of(static_cast<std::size_t>(link[1]))) inside.push_back(link);
  }
  parent = components(static_cast<int32_t>(finer.place.size()), inside);
  Grid grid;
  for (std::size_t c = 0; c < parent.size(); ++c) {
    if (static_cast<std::size_t>(parent[c]) == grid.place.size()) grid.place.push_back(box_of(c));
  }
  for (const auto& link : finer.links) {
    const auto [a, b] =
        std::minmax(parent[static_cast<std::size_t>(link[0])], parent[static_cast<std::size_t>(link[1])]);
    if (a != b) grid.links.push_back({a, b});
  }
  std::sort(grid.links.begin(), grid.links.end());
  grid.links.erase(std::unique(grid.links.begin(), grid.links.end()), grid.links.end());
  std::vector<std::array<int32_t, 2>> shared;  // of eight corners of each cell
  for (const auto& [a, b] : grid.links) {
    const auto &one = grid.place[static_cast<std::size_t>(a)], &other = grid.place[static_cast<std::size_t>(b)];
    for (int k = 0; k < 64; ++k) {
      bool is_same = true;
      for (int axis = 0; axis < 3; ++axis)
        is_same &= one[axis] + kEnds[k / 8][axis] == other[axis] + kEnds[k % 8][axis];
      if (is_same) shared.push_back({8 * a + k / 8, 8 * b + k % 8});
    }
  }
  const std::vector<int32_t> node = components(static_cast<int32_t>(8 * grid.place.size()), shared);
  for (std::size_t k = 0; k < node.size(); ++k) {
    if (k % 8 == 0) grid.corners.emplace_back();
    grid.corners.back()[k % 8] = node[k];
    grid.nodes = std::max(grid.nodes, static_cast<std::size_t>(node[k]) + 1);
  }
  return grid;
}

}  // namespace cutproof::baselines::fem
