// Surface nets on a grid whose nodes live or not: a vertex in each cell for each piece of the surface that passes it,
// and a polygon around each edge that leaves the tissue. Right, or wrong in the ways that such methods are.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace surface_nets {

using Place = std::array<double, 3>;

struct Net {
  std::vector<Place> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  // [vertices] an edge of the cell that leaves the tissue: 3 · its lower node + its axis.
  std::vector<int64_t> edge;
};

// `place`: of an edge that leaves the tissue. `fault`: "pinched" (a vertex for each cell, whatever passes it),
// "doubled" (two pieces that pass the same face share an edge), "outside" (the first vertex lies beside its cell); else
// right.
inline Net make(const std::array<int32_t, 3>& nodes, const std::vector<uint8_t>& living,
                const std::function<Place(int64_t edge)>& place, const std::string& fault) {
  const std::array<int64_t, 3> step = {1, nodes[0], int64_t{nodes[0]} * nodes[1]};
  const auto lives = [&](int64_t node) { return living[static_cast<std::size_t>(node)] != 0; };
  // The edge between two neighbouring nodes.
  const auto between = [&](int64_t a, int64_t b) {
    const int64_t low = a < b ? a : b, apart = a < b ? b - a : a - b;
    return 3 * low + (apart == step[2] ? 2 : apart == step[1] ? 1 : 0);
  };
  Net net;
  const auto add_vertex = [&](const std::vector<int64_t>& edges) {
    Place mean = {};
    for (const int64_t edge : edges) {
      const Place at = place(edge);
      for (std::size_t k = 0; k < 3; ++k) mean[k] += at[k] / static_cast<double>(edges.size());
    }
    net.vertices.push_back(mean);
    net.edge.push_back(edges.front());
    return static_cast<int32_t>(net.vertices.size()) - 1;
  };
  // Corners of the face that stands on a node, across the axis `normal`, one after the other.
  const auto face = [&](int64_t node, std::size_t normal) {
    const int64_t b = step[(normal + 1) % 3], c = step[(normal + 2) % 3];
    return std::array<int64_t, 4>{node, node + b, node + b + c, node + c};
  };
  const auto is_ambiguous = [&](const std::array<int64_t, 4>& f) {
    return lives(f[0]) == lives(f[2]) && lives(f[1]) == lives(f[3]) && lives(f[0]) != lives(f[1]);
  };

  std::map<std::pair<int64_t, int64_t>, int32_t> vertex_of;  // cell by its lowest node, edge
  for (int32_t z = 0; z + 1 < nodes[2]; ++z) {
    for (int32_t y = 0; y + 1 < nodes[1]; ++y) {
      for (int32_t x = 0; x + 1 < nodes[0]; ++x) {
        const int64_t cell = x + step[1] * y + step[2] * z;
        std::map<int64_t, int64_t> joined;  // edge -> another of its piece
        const auto root = [&](int64_t edge) {
          while (joined.at(edge) != edge) edge = joined.at(edge);
          return edge;
        };
        for (std::size_t normal = 0; normal < 3; ++normal) {
          for (const int64_t side : {cell, cell + step[normal]}) {
            const auto f = face(side, normal);
            std::vector<int64_t> cut;
            for (std::size_t k = 0; k < 4; ++k) {
              if (lives(f[k]) == lives(f[(k + 1) % 4])) continue;
              cut.push_back(between(f[k], f[(k + 1) % 4]));
              joined.try_emplace(cut.back(), cut.back());
            }
            if (cut.size() == 2) joined[root(cut[0])] = root(cut[1]);
            // Living corners are parted.
            for (std::size_t k = 0; cut.size() == 4 && k < 4; ++k) {
              if (lives(f[k])) joined[root(between(f[(k + 3) % 4], f[k]))] = root(between(f[k], f[(k + 1) % 4]));
            }
          }
        }
        std::map<int64_t, std::vector<int64_t>> pieces;
        for (const auto& [edge, other] : joined) pieces[fault == "pinched" ? 0 : root(edge)].push_back(edge);
        for (const auto& [first, edges] : pieces) {
          const int32_t vertex = add_vertex(edges);
          for (const int64_t edge : edges) vertex_of[{cell, edge}] = vertex;
        }
      }
    }
  }

  std::map<std::array<int64_t, 3>, int32_t> on_face;  // node, normal, living corner
  for (int64_t low = 0; low < static_cast<int64_t>(living.size()); ++low) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::array<int64_t, 3> at = {low % step[1], low / step[1] % nodes[1], low / step[2]};
      if (at[axis] + 1 >= nodes[axis] || lives(low) == lives(low + step[axis])) continue;
      const std::size_t b_axis = (axis + 1) % 3, c_axis = (axis + 2) % 3;
      const int64_t b = step[b_axis], c = step[c_axis], edge = 3 * low + static_cast<int64_t>(axis);
      const int64_t alive_end = lives(low) ? low : low + step[axis];
      // Cells around the edge, counter-clockwise seen from where the axis leads, and the face behind each.
      const std::array<int64_t, 4> cells = {low, low - b, low - b - c, low - c};
      const std::array<std::pair<int64_t, std::size_t>, 4> faces = {
          {{low, b_axis}, {low - b, c_axis}, {low - c, b_axis}, {low, c_axis}}};
      std::vector<int32_t> polygon;
      std::ptrdiff_t apex = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        polygon.push_back(vertex_of.at({cells[k], edge}));
        const auto& [node, normal] = faces[k];
        const auto f = face(node, normal);
        if (!is_ambiguous(f) || fault == "doubled") continue;
        // Two pieces pass this face: each has a vertex there, so that neighbouring cells share no edge twice.
        const std::array<int64_t, 3> key = {node, static_cast<int64_t>(normal), alive_end};
        auto known = on_face.find(key);
        if (known == on_face.end()) {
          std::vector<int64_t> ends;
          for (std::size_t corner = 0; corner < 4; ++corner) {
            if (f[corner] == alive_end) {
              ends = {between(f[(corner + 3) % 4], alive_end), between(alive_end, f[(corner + 1) % 4])};
            }
          }
          known = on_face.emplace(key, add_vertex(ends)).first;
        }
        apex = std::ssize(polygon);
        polygon.push_back(known->second);
      }
      // Seen from a vertex on a face, so that no diagonal runs beside it, where the other piece may have one too.
      std::rotate(polygon.begin(), polygon.begin() + apex, polygon.end());
      for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
        if (lives(low)) {
          net.triangles.push_back({polygon[0], polygon[k], polygon[k + 1]});
        } else {
          net.triangles.push_back({polygon[0], polygon[k + 1], polygon[k]});
        }
      }
    }
  }
  if (fault == "outside" && !net.vertices.empty()) net.vertices[0][0] -= 2;
  return net;
}

}  // namespace surface_nets
