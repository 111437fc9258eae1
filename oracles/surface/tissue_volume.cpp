#include "oracles/surface/tissue_volume.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>

namespace cutproof::oracles {
namespace {

std::array<int, 3> corner_coordinates(int corner) { return {corner & 1, (corner >> 1) & 1, (corner >> 2) & 1}; }

// The four corners of each face of a cell, counter-clockwise seen from outside the cell. Corner number: x + 2y + 4z.
constexpr std::array<std::array<int, 4>, 6> kFaceCorners = {
    {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}}};

// A skin vertex inside a cell, by the two ends of its edge.
struct CellVertex {
  int inside = 0, outside = 0;
  friend auto operator<=>(const CellVertex&, const CellVertex&) = default;
};

// How far from its inner end each grid edge of a cell carries its vertex, in h: by inner corner and axis.
using Reaches = std::array<std::array<double, 3>, 8>;

int axis_between(int a, int b) { return (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2; }
double reach_of(const Reaches& reaches, CellVertex v) {
  return reaches[static_cast<std::size_t>(v.inside)][static_cast<std::size_t>(axis_between(v.inside, v.outside))];
}

// Relative to the middle of the cell, in units of h.
Vec3 cell_position(CellVertex v, const Reaches& reaches) {
  const auto a = corner_coordinates(v.inside), b = corner_coordinates(v.outside);
  Vec3 p;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    p[axis] = a[i] + reach_of(reaches, v) * (b[i] - a[i]) - 0.5;
  }
  return p;
}

// The closed polygons in which the skin meets a cell, outward. On each face every run of inside corners is cut off by
// one segment from where the run is entered to where it is left, which keeps diagonal inside corners apart.
std::vector<std::vector<CellVertex>> cell_loops(int pattern) {
  const auto inside = [pattern](int corner) { return ((pattern >> corner) & 1) != 0; };
  std::map<CellVertex, CellVertex> next;
  for (const auto& face : kFaceCorners) {
    for (std::size_t first = 0; first < 4; ++first) {
      const int before = face[(first + 3) % 4];
      if (!inside(face[first]) || inside(before)) continue;
      std::size_t last = first;
      while (inside(face[(last + 1) % 4])) ++last;
      next[{face[first], before}] = {face[last % 4], face[(last + 1) % 4]};
    }
  }
  std::vector<std::vector<CellVertex>> loops;
  while (!next.empty()) {
    std::vector<CellVertex> loop;
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      loop.push_back(at->second);
      next.erase(at);
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

double cone_volume(Vec3 a, Vec3 b, Vec3 c) { return dot(a, cross(b, c)) / 6; }

// Least and greatest volume under any triangulation of one polygon, as cones to the middle of the cell.
VolumeRange polygon_volume(const std::vector<Vec3>& p) {
  const std::size_t n = p.size();
  std::vector<std::vector<VolumeRange>> best(n, std::vector<VolumeRange>(n));
  for (std::size_t width = 2; width < n; ++width) {
    for (std::size_t i = 0; i + width < n; ++i) {
      const std::size_t j = i + width;
      VolumeRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
      for (std::size_t k = i + 1; k < j; ++k) {
        const double volume = cone_volume(p[i], p[k], p[j]);
        range.low = std::min(range.low, best[i][k].low + best[k][j].low + volume);
        range.high = std::max(range.high, best[i][k].high + best[k][j].high + volume);
      }
      best[i][j] = range;
    }
  }
  return best[0][n - 1];
}

// Area of tissue on a face of a cell: marching squares, diagonal inside corners apart. Each run of inside corners is a
// polygon of its own: its corners, and the vertices where it is left and entered.
double face_area(int pattern, const std::array<int, 4>& face, const Reaches& reaches) {
  const auto inside = [&](std::size_t i) { return ((pattern >> face[i % 4]) & 1) != 0; };
  // Of corner i of the face, and of the vertex on the edge from inner corner i to corner j: on the unit square.
  const auto corner = [](std::size_t i) {
    return std::array<double, 2>{i % 4 == 1 || i % 4 == 2 ? 1.0 : 0.0, i % 4 >= 2 ? 1.0 : 0.0};
  };
  const auto vertex = [&](std::size_t i, std::size_t j) {
    const double reach = reach_of(reaches, {face[i % 4], face[j % 4]});
    const auto a = corner(i), b = corner(j);
    return std::array<double, 2>{a[0] + reach * (b[0] - a[0]), a[1] + reach * (b[1] - a[1])};
  };
  if (inside(0) && inside(1) && inside(2) && inside(3)) return 1;
  double twice = 0;
  for (std::size_t first = 0; first < 4; ++first) {
    if (!inside(first) || inside(first + 3)) continue;
    std::vector<std::array<double, 2>> run = {vertex(first, first + 3), corner(first)};
    std::size_t last = first;
    while (inside(last + 1)) run.push_back(corner(++last));
    run.push_back(vertex(last, last + 1));
    for (std::size_t k = 0; k < run.size(); ++k) {
      const auto &p = run[k], &q = run[(k + 1) % run.size()];
      twice += p[0] * q[1] - p[1] * q[0];
    }
  }
  return twice / 2;
}

VolumeRange cell_volume(int pattern, const Reaches& reaches) {
  VolumeRange total;
  for (const auto& face : kFaceCorners) {
    const double cone = face_area(pattern, face, reaches) / 6;  // area times half an edge over three
    total.add({cone, cone});
  }
  for (const auto& loop : cell_loops(pattern)) {
    std::vector<Vec3> points;
    for (const CellVertex v : loop) points.push_back(cell_position(v, reaches));
    total.add(polygon_volume(points));
  }
  return total;
}

}  // namespace

bool lie_alike(const Skin& skin) {
  return std::ranges::all_of(skin.reach, [&](double reach) { return reach == skin.reach.front(); });
}

VolumeRange tissue_volume(const Setup& setup, const Skin& skin, const std::vector<uint8_t>& tissue) {
  const Body& body = setup.body;
  const Grid& grid = body.grid;
  // Where each vertex lies on its edge.
  const double alpha = skin.reach.empty() ? setup.skin.alpha : skin.reach.front();
  const bool all_alike = lie_alike(skin);
  std::vector<double> reach_on(all_alike ? 0 : 6 * static_cast<std::size_t>(body.particle_count()), setup.skin.alpha);
  for (std::size_t v = 0; v < skin.owner.size() && !all_alike; ++v) {
    reach_on[6 * static_cast<std::size_t>(skin.owner[v]) + skin.direction[v]] = skin.reach[v];
  }
  std::array<int64_t, 256> alike{};
  VolumeRange total;
  for (int32_t k = 0; k + 1 < grid.nodes[2]; ++k) {
    for (int32_t j = 0; j + 1 < grid.nodes[1]; ++j) {
      for (int32_t i = 0; i + 1 < grid.nodes[0]; ++i) {
        const int64_t node = grid.index(i, j, k);
        int pattern = 0;
        std::array<std::size_t, 8> node_of{};
        for (int corner = 0; corner < 8; ++corner) {
          const auto c = corner_coordinates(corner);
          const auto at =
              static_cast<std::size_t>(node + c[0] + int64_t{grid.nodes[0]} * (c[1] + int64_t{grid.nodes[1]} * c[2]));
          node_of[static_cast<std::size_t>(corner)] = at;
          pattern |= tissue[at] << corner;
        }
        if (all_alike || pattern == 0 || pattern == 255) {
          ++alike[static_cast<std::size_t>(pattern)];
          continue;
        }
        Reaches reaches{};
        for (int corner = 0; corner < 8; ++corner) {
          if ((pattern >> corner & 1) == 0) continue;
          const auto at = static_cast<std::size_t>(corner);
          for (int axis = 0; axis < 3; ++axis) {
            const int direction = 2 * axis + (corner >> axis & 1);  // into the cell
            const auto owner = static_cast<std::size_t>(body.particle_at[node_of[at]]);
            reaches[at][static_cast<std::size_t>(axis)] = reach_on[6 * owner + static_cast<std::size_t>(direction)];
          }
        }
        total.add(cell_volume(pattern, reaches));
      }
    }
  }
  Reaches same;
  for (auto& of_corner : same) of_corner.fill(alpha);
  for (int pattern = 1; pattern < 256; ++pattern) {
    const auto count = static_cast<double>(alike[static_cast<std::size_t>(pattern)]);
    if (count != 0) total.add(cell_volume(pattern, same), count);
  }
  return total;
}

}  // namespace cutproof::oracles
