// Hexahedra of both programs, on the host: refinement, links between cells, and what a cut does to nodes.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "baselines/dissection.h"

namespace cutproof::baselines::fem {

using Corners = Eigen::Matrix<double, 8, 3>;  // places of a cell's corners in VTK's order, m

// Of a corner in VTK's order: which end of each axis it is at.
inline constexpr int kEnds[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
// Corners of its faces and edges.
inline constexpr int kFaces[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                     {3, 2, 6, 7}, {0, 3, 7, 4}, {1, 2, 6, 5}};
inline constexpr int kEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                      {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
inline constexpr int kDiagonals[4][2] = {{0, 6}, {1, 7}, {2, 4}, {3, 5}};

struct Mesh {
  std::vector<std::array<int32_t, 8>> cells;                    // [c] nodes in VTK's order
  std::vector<double> cell_mass;                                // [c] kg
  std::vector<uint8_t> is_removed;                              // [c]
  std::vector<std::array<int32_t, 2>> links;                    // [l] cells that share a face, the lower one first
  std::vector<uint8_t> is_cut;                                  // [l]
  std::vector<uint8_t> is_touched;                              // [c] 1: split() has to look at its nodes
  std::vector<Vec3> rest;                                       // [p] m; the first n nodes are the scene's particles
  std::vector<double> own_mass;                                 // [p] kg of particles in no cell; otherwise 0
  std::vector<uint8_t> held;                                    // [p]
  std::vector<int32_t> parent;                                  // [p] the node that one was split from, or -1
  std::vector<std::vector<std::pair<int32_t, double>>> shares;  // [nodes at the start] particles, weights; sum 1
};

template <class T>
Corners corners_of(const std::vector<T>& places, const std::array<int32_t, 8>& cell) {
  Corners corners;
  for (int a = 0; a < 8; ++a) corners.row(a) = places[static_cast<std::size_t>(cell[a])].transpose();
  return corners;
}

// The volume of a trilinear hexahedron: two Gauss points an axis are exact for its determinant.
inline double volume_of(const Corners& corners) {
  double volume = 0;
  for (const auto& at : kEnds) {
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
    for (int a = 0; a < 8; ++a) {
      Vec3 slope;
      for (int k = 0; k < 3; ++k) {
        slope[k] = kEnds[a][k] == 1 ? 1 : -1;
        for (int other = 0; other < 3; ++other) {
          const double to = 0.5 + (at[other] == 1 ? 0.5 : -0.5) / std::sqrt(3.0);
          if (other != k) slope[k] *= kEnds[a][other] == 1 ? to : 1 - to;
        }
      }
      jacobian += corners.row(a).transpose() * slope.transpose();
    }
    const double determinant = jacobian.determinant();
    if (!(determinant > 0)) return 0;
    volume += determinant / 8;
  }
  return volume;
}

// The scene's hexahedra, each divided into refine³. Masses by volume: `density` in kg/m³, or with 0 the masses of all
// particles in cells, spread evenly over the cells' volume. Throws std::invalid_argument for a cell without volume.
inline Mesh mesh_of(const Scene& scene, int refine, double density) {
  Mesh mesh;
  const std::size_t n = scene.rest.size();
  mesh.rest = scene.rest;
  mesh.held = scene.held;
  for (std::size_t i = 0; i < n; ++i) mesh.shares.push_back({{static_cast<int32_t>(i), 1.0}});
  // Nodes by the particles between which they lie, and integer weights, so that neighbours share them exactly.
  std::map<std::vector<std::pair<int32_t, int>>, int32_t> number;
  const auto node_at = [&](const std::array<int32_t, 8>& cell, const std::array<int, 3>& place) {
    std::map<int32_t, int> weight;
    for (int a = 0; a < 8; ++a) {
      int share = 1;
      for (int k = 0; k < 3; ++k) share *= kEnds[a][k] == 1 ? place[k] : refine - place[k];
      if (share > 0) weight[cell[a]] += share;
    }
    if (weight.size() == 1) return weight.begin()->first;
    const auto [found, is_new] =
        number.try_emplace({weight.begin(), weight.end()}, static_cast<int32_t>(mesh.rest.size()));
    if (is_new) {
      auto& shares = mesh.shares.emplace_back();
      Vec3 rest = Vec3::Zero();
      uint8_t held = 1;
      for (const auto& [particle, share] : weight) {
        shares.emplace_back(particle, share / std::pow(refine, 3));
        rest += shares.back().second * scene.rest[static_cast<std::size_t>(particle)];
        held = held != 0 && scene.held[static_cast<std::size_t>(particle)] != 0 ? 1 : 0;
      }
      mesh.rest.push_back(rest);
      mesh.held.push_back(held);
    }
    return found->second;
  };
  for (const auto& cell : scene.hexahedra) {
    for (int k = 0; k < refine * refine * refine; ++k) {
      std::array<int32_t, 8> part;
      for (int a = 0; a < 8; ++a)
        part[a] = node_at(
            cell, {k % refine + kEnds[a][0], k / refine % refine + kEnds[a][1], k / refine / refine + kEnds[a][2]});
      mesh.cells.push_back(part);
    }
  }
  std::vector<uint8_t> in_cell(n, 0);
  for (const auto& cell : scene.hexahedra) {
    for (const int32_t i : cell) in_cell[static_cast<std::size_t>(i)] = 1;
  }
  double of_cells = 0, volume = 0;
  mesh.own_mass.assign(mesh.rest.size(), 0);
  for (std::size_t i = 0; i < n; ++i) (in_cell[i] != 0 ? of_cells : mesh.own_mass[i]) += scene.mass[i];
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    mesh.cell_mass.push_back(volume_of(corners_of(mesh.rest, mesh.cells[c])));
    if (!(mesh.cell_mass.back() > 0))
      throw std::invalid_argument("hexahedron " +
                                  std::to_string(c / static_cast<std::size_t>(refine * refine * refine)) +
                                  " has no volume at rest, or corners in another order than VTK's; correct it");
    volume += mesh.cell_mass.back();
  }
  for (double& mass : mesh.cell_mass) mass *= density > 0 ? density : of_cells / volume;
  mesh.is_removed.assign(mesh.cells.size(), 0);
  mesh.is_touched.assign(mesh.cells.size(), 1);
  mesh.parent.assign(mesh.rest.size(), -1);
  std::map<std::array<int32_t, 4>, int32_t> cell_at;
  for (int32_t c = 0; c < static_cast<int32_t>(mesh.cells.size()); ++c) {
    for (const auto& face : kFaces) {
      std::array<int32_t, 4> nodes;
      for (int k = 0; k < 4; ++k) nodes[k] = mesh.cells[static_cast<std::size_t>(c)][face[k]];
      std::sort(nodes.begin(), nodes.end());
      const auto [found, is_new] = cell_at.try_emplace(nodes, c);
      if (!is_new) mesh.links.push_back({found->second, c});
    }
  }
  mesh.is_cut.assign(mesh.links.size(), 0);
  return mesh;
}

// Values of the particles, at all nodes of the start.
inline std::vector<Vec3> interpolated(const Mesh& mesh, const std::vector<Vec3>& of_particles) {
  std::vector<Vec3> values;
  for (const auto& shares : mesh.shares) {
    Vec3 value = Vec3::Zero();
    for (const auto& [particle, weight] : shares) value += weight * of_particles[static_cast<std::size_t>(particle)];
    values.push_back(value);
  }
  return values;
}

// Cells around each node: node i has cells[offsets[i]] .. cells[offsets[i + 1] - 1], ascending, without removed ones.
struct Around {
  std::vector<std::size_t> offsets;
  std::vector<int32_t> cells;
};
inline Around around_nodes(const Mesh& mesh) {
  Around around;
  around.offsets.assign(mesh.rest.size() + 1, 0);
  const auto visit = [&](const auto& see) {
    for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
      for (const int32_t i : mesh.cells[c]) {
        if (mesh.is_removed[c] == 0) see(static_cast<std::size_t>(i), static_cast<int32_t>(c));
      }
    }
  };
  visit([&](std::size_t i, int32_t) { ++around.offsets[i + 1]; });
  std::partial_sum(around.offsets.begin(), around.offsets.end(), around.offsets.begin());
  around.cells.resize(around.offsets.back());
  std::vector<std::size_t> next = around.offsets;
  visit([&](std::size_t i, int32_t c) { around.cells[next[i]++] = c; });
  return around;
}

// Return whether that is new.
inline bool cut_link(Mesh& mesh, std::size_t link) {
  const bool is_new = mesh.is_cut[link] == 0;
  mesh.is_cut[link] = 1;
  for (const int32_t c : mesh.links[link]) mesh.is_touched[static_cast<std::size_t>(c)] = 1;
  return is_new;
}
inline bool remove_cell(Mesh& mesh, std::size_t cell) {
  const bool is_new = mesh.is_removed[cell] == 0;
  mesh.is_removed[cell] = 1;
  if (is_new) mesh.is_touched[cell] = 1;
  return is_new;
}

// Gives each group of a node's cells, as uncut links around that node join them, a node of its own. The group with the
// lowest cell keeps the node. Returns the parent of each new node; they are appended in that order.
inline std::vector<int32_t> split(Mesh& mesh) {
  const Around around = around_nodes(mesh);
  std::vector<std::vector<int32_t>> linked(mesh.cells.size());
  for (std::size_t l = 0; l < mesh.links.size(); ++l) {
    const auto [a, b] = mesh.links[l];
    const bool is_gone =
        mesh.is_removed[static_cast<std::size_t>(a)] + mesh.is_removed[static_cast<std::size_t>(b)] > 0;
    if (mesh.is_cut[l] == 0 && !is_gone) linked[static_cast<std::size_t>(a)].push_back(b);
  }
  std::vector<int32_t> parents;
  const std::size_t count = mesh.rest.size();
  std::vector<uint8_t> is_due(count, 0);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (const int32_t i : mesh.cells[c]) is_due[static_cast<std::size_t>(i)] |= mesh.is_touched[c];
    mesh.is_touched[c] = 0;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (is_due[i] == 0) continue;
    const auto begin = around.cells.begin() + static_cast<std::ptrdiff_t>(around.offsets[i]),
               end = around.cells.begin() + static_cast<std::ptrdiff_t>(around.offsets[i + 1]);
    std::vector<std::array<int32_t, 2>> joined;
    for (auto a = begin; a != end; ++a) {
      for (const int32_t other : linked[static_cast<std::size_t>(*a)]) {
        const auto b = std::lower_bound(begin, end, other);
        if (b != end && *b == other)
          joined.push_back({static_cast<int32_t>(a - begin), static_cast<int32_t>(b - begin)});
      }
    }
    const std::vector<int32_t> group = components(static_cast<int32_t>(end - begin), joined);
    const auto first_new = static_cast<int32_t>(mesh.rest.size());
    int32_t groups = 1;
    for (std::size_t k = 0; k < group.size(); ++k) {
      groups = std::max(groups, group[k] + 1);
      if (group[k] == 0) continue;
      auto& cell = mesh.cells[static_cast<std::size_t>(*(begin + static_cast<std::ptrdiff_t>(k)))];
      std::replace(cell.begin(), cell.end(), static_cast<int32_t>(i), first_new + group[k] - 1);
    }
    for (int32_t g = 1; g < groups; ++g) {
      parents.push_back(static_cast<int32_t>(i));
      mesh.rest.push_back(mesh.rest[i]);
      mesh.held.push_back(mesh.held[i]);
      mesh.own_mass.push_back(0);
      mesh.parent.push_back(static_cast<int32_t>(i));
    }
  }
  return parents;
}

// [p] kg: an eighth of each cell around a node.
inline std::vector<double> lumped_mass(const Mesh& mesh) {
  std::vector<double> mass = mesh.own_mass;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (const int32_t i : mesh.cells[c]) {
      if (mesh.is_removed[c] == 0) mass[static_cast<std::size_t>(i)] += mesh.cell_mass[c] / 8;
    }
  }
  return mass;
}

// [p] equal for nodes that cells join.
inline std::vector<int32_t> node_components(const Mesh& mesh) {
  std::vector<std::array<int32_t, 2>> pairs;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (int a = 1; a < 8 && mesh.is_removed[c] == 0; ++a) pairs.push_back({mesh.cells[c][0], mesh.cells[c][a]});
  }
  return components(static_cast<int32_t>(mesh.rest.size()), pairs);
}

// What a frame says of topology. Nodes whose cells are all removed are dead, and have the mass of those.
inline Frame frame_of(const Mesh& mesh, bool changed) {
  Frame frame;
  frame.mass = lumped_mass(mesh);
  for (const double mass : frame.mass) frame.alive.push_back(mass > 0 ? 1 : 0);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    for (const int32_t i : mesh.cells[c]) {
      if (frame.alive[static_cast<std::size_t>(i)] == 0)
        frame.mass[static_cast<std::size_t>(i)] += mesh.cell_mass[c] / 8;
    }
  }
  frame.parent = mesh.parent;
  frame.has_cells = changed;
  for (std::size_t c = 0; changed && c < mesh.cells.size(); ++c) {
    if (mesh.is_removed[c] == 0) frame.hexahedra.push_back(mesh.cells[c]);
  }
  return frame;
}

// Segments of a cell; where the blade crosses one it meets the cell: edges, diagonals, and between centres of opposite
// faces. A patch that is smaller than all gaps between these is missed.
inline constexpr int kSegments = 19;
// Corners of which the ends of segment s are the means: `count` of them.
struct Ends {
  int count;
  int first[4], second[4];
};
inline constexpr Ends segment(int s) {
  if (s < 12) return {1, {kEdges[s][0]}, {kEdges[s][1]}};
  if (s < 16) return {1, {kDiagonals[s - 12][0]}, {kDiagonals[s - 12][1]}};
  const auto& a = kFaces[2 * (s - 16)];
  const auto& b = kFaces[2 * (s - 16) + 1];
  return {4, {a[0], a[1], a[2], a[3]}, {b[0], b[1], b[2], b[3]}};
}

}  // namespace cutproof::baselines::fem
