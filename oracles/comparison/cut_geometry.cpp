#include "oracles/comparison/cut_geometry.h"

#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/max_cardinality_matching.hpp>
#include <cmath>
#include <limits>

#include "oracles/blade_motion.h"
#include "oracles/comparison/lattice_lines.h"
#include "oracles/comparison/plate_sweep.h"
#include "oracles/oracles.h"
#include "oracles/shells.h"
#include "oracles/support.h"
#include "oracles/surface/surface_distance.h"

namespace cutproof::oracles {

namespace {

// --- The ideal cut ---------------------------------------------------------------------------------------------------

// Crossings of one line that are nearer to each other than this, at right angles to the cut, count as one [h]. The
// blade passes such a place twice, because it goes back or because pushed tissue springs back to it. Particles cannot
// resolve cuts that lie nearer.
constexpr double kSameCut = 0.5;

void add_quad(std::vector<Triangle>& surface, Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  for (const Triangle& t : {Triangle{a, b, c}, Triangle{a, c, d}}) {
    if (norm(cross(t[1] - t[0], t[2] - t[0])) > 0) surface.push_back(t);
  }
}

bool is_tissue(const Body& body, const State& before, const std::array<int64_t, 3>& node) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (node[axis] < 0 || node[axis] >= body.grid.nodes[axis]) return false;
  }
  const int32_t i = body.particle_at[at(
      body.grid.index(static_cast<int32_t>(node[0]), static_cast<int32_t>(node[1]), static_cast<int32_t>(node[2])))];
  return i >= 0 && before.alive[at(i)] != 0;
}

struct IdealCut {
  double area = 0;            // [h²]
  std::vector<Vec3> samples;  // points of it inside the tissue
};

IdealCut ideal_cut(const Body& body, const State& before, const std::vector<Triangle>& surface) {
  const double h = body.grid.spacing;
  IdealCut cut;
  for (int axis = 0; axis < 3; ++axis) {
    Lattice lattice{axes_of(axis), {-h / 2, -h / 2}, {}, {h / kLinesPerSpacing, h / kLinesPerSpacing}};
    lattice.count = {int64_t{body.grid.nodes[at(lattice.axes.u)]} * kLinesPerSpacing,
                     int64_t{body.grid.nodes[at(lattice.axes.v)]} * kLinesPerSpacing};
    std::vector<Crossing> crossings;
    const auto point_of = [&](const Crossing& c) {
      Vec3 p;
      p[axis] = c.at;
      p[lattice.axes.u] = lattice.place(0, c.line % lattice.count[0]);
      p[lattice.axes.v] = lattice.place(1, c.line / lattice.count[0]);
      return p;
    };
    for (const Triangle& triangle : surface) {
      cross_lines(lattice, triangle, [&](const Crossing& c) {
        const Vec3 p = point_of(c);
        std::array<int64_t, 3> node;
        for (int k = 0; k < 3; ++k) node[at(k)] = static_cast<int64_t>(std::floor(p[k] / h + 0.5));
        if (is_tissue(body, before, node)) crossings.push_back(c);
      });
    }
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& a, const Crossing& b) { return a.line != b.line ? a.line < b.line : a.at < b.at; });
    for (std::size_t k = 0; k < crossings.size();) {
      const Crossing& first = crossings[k];
      double steepest = std::abs(first.normal);
      std::size_t end = k + 1;
      for (; end < crossings.size() && crossings[end].line == first.line; ++end) {
        if ((crossings[end].at - crossings[end - 1].at) * std::abs(crossings[end].normal) > kSameCut * h) break;
        steepest = std::max(steepest, std::abs(crossings[end].normal));
      }
      cut.area += steepest / (kLinesPerSpacing * kLinesPerSpacing);
      cut.samples.push_back(point_of(first));
      k = end;
    }
  }
  return cut;
}

// The fewest particles without which no edge of the grid is left that crosses the surface. Neighbours on a grid differ
// in whether the sum of their coordinates is even, so the graph of these edges is bipartite: the fewest that touch all
// of its edges are as many as the most edges of which no two share an end (D. König, Gráfok és mátrixok, 1931).
int64_t least_removed(const Body& body, const State& before, const std::vector<Triangle>& surface) {
  const double h = body.grid.spacing;
  using Ends = std::pair<int64_t, int64_t>;  // grid nodes, the lower first
  std::vector<Ends> edges;
  const auto index_of = [&](const std::array<int64_t, 3>& node) {
    return int64_t{
        body.grid.index(static_cast<int32_t>(node[0]), static_cast<int32_t>(node[1]), static_cast<int32_t>(node[2]))};
  };
  for (int axis = 0; axis < 3; ++axis) {
    Lattice lattice{axes_of(axis), {-h / 2, -h / 2}, {}, {h, h}};
    lattice.count = {body.grid.nodes[at(lattice.axes.u)], body.grid.nodes[at(lattice.axes.v)]};
    for (const Triangle& triangle : surface) {
      cross_lines(lattice, triangle, [&](const Crossing& c) {
        std::array<int64_t, 3> node;
        node[at(axis)] = static_cast<int64_t>(std::floor(c.at / h));
        node[at(lattice.axes.u)] = c.line % lattice.count[0];
        node[at(lattice.axes.v)] = c.line / lattice.count[0];
        std::array<int64_t, 3> upper = node;
        ++upper[at(axis)];
        if (is_tissue(body, before, node) && is_tissue(body, before, upper)) {
          edges.emplace_back(index_of(node), index_of(upper));
        }
      });
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  // Vertices are the ends of these edges and no others: each search for a greater matching looks at all of them.
  std::vector<int64_t> ends;
  for (const auto& [low, high] : edges) {
    ends.push_back(low);
    ends.push_back(high);
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  const auto vertex = [&](int64_t node) {
    return static_cast<std::size_t>(std::lower_bound(ends.begin(), ends.end(), node) - ends.begin());
  };
  boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS> graph(ends.size());
  for (const auto& [low, high] : edges) boost::add_edge(vertex(low), vertex(high), graph);
  std::vector<std::size_t> mate(ends.size());
  boost::edmonds_maximum_cardinality_matching(graph, mate.data());
  return static_cast<int64_t>(boost::matching_size(graph, mate.data()));
}

// --- The new skin ----------------------------------------------------------------------------------------------------

struct NewSkin {
  std::vector<Triangle> triangles;
  std::vector<Vec3> vertices;
};

NewSkin new_skin(const Setup& setup, const State& before, const State& after) {
  const Body& body = setup.body;
  const Skin& skin = after.skin;
  NewSkin result;
  std::vector<uint8_t> is_new(skin.owner.size(), 0);
  std::vector<Vec3> rest(skin.owner.size());
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t i = skin.owner[v], other = body.neighbour(i, skin.direction[v]);
    rest[v] = vertex_at_rest(setup, skin, v);
    is_new[v] = other >= 0 && before.alive[at(other)] != 0 && after.alive[at(other)] == 0;
    if (is_new[v]) result.vertices.push_back(rest[v]);
  }
  for (const auto& [a, b, c] : skin.triangles) {
    if (is_new[at(a)] && is_new[at(b)] && is_new[at(c)])
      result.triangles.push_back({rest[at(a)], rest[at(b)], rest[at(c)]});
  }
  return result;
}

// Points of triangles, no point of them farther than edge / √3 from one: corners of an even division whose edges are at
// most `edge` long. (A triangle with edges up to e has no point farther than e / √3 from all its corners.)
std::vector<Vec3> points_of(const std::vector<Triangle>& triangles, double edge) {
  std::vector<Vec3> points;
  for (const auto& [a, b, c] : triangles) {
    const double longest = std::max({norm(b - a), norm(c - b), norm(a - c)});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / edge)));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        points.push_back(a + (static_cast<double>(i) / n) * (b - a) + (static_cast<double>(j) / n) * (c - a));
      }
    }
  }
  return points;
}

double greatest_of(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

}  // namespace

std::vector<Triangle> swept_surface(const Setup& setup, int64_t first_frame, int64_t end_frame) {
  std::vector<Triangle> surface;
  if (!setup.has_blade) return surface;
  const auto add_plate = [&](const BladePose& pose) {
    const auto [a, b, c, d] = plate_of(setup.blade, pose);
    add_quad(surface, a, b, c, d);
  };
  const BladeMove* before = nullptr;  // the last move, if the blade was down
  for (int64_t k = first_frame * setup.step.substeps; k < end_frame * setup.step.substeps; ++k) {
    const BladeMove& move = setup.blade_moves[at(k)];
    const bool goes_on = before != nullptr && move.down && before->stroke == move.stroke;
    if (before != nullptr && !goes_on) add_plate(before->to);
    if (move.down && !goes_on) add_plate(move.from);
    before = move.down ? &move : nullptr;
    if (!move.down) continue;
    const int pieces = turning_pieces(setup, move);
    for (int piece = 0; piece < pieces; ++piece) {
      const auto corners = [&](int p) {
        return plate_of(setup.blade, pose_between(move.from, move.to, static_cast<double>(p) / pieces));
      };
      const auto from = corners(piece), to = corners(piece + 1);
      for (std::size_t side = 0; side < 4; ++side) {
        const std::size_t next = (side + 1) % 4;
        add_quad(surface, from[side], from[next], to[next], to[side]);
      }
    }
  }
  if (before != nullptr) add_plate(before->to);
  return surface;
}

std::optional<double> CutGeometry::hausdorff() const {
  if (!skin_to_ideal || !ideal_to_skin) return std::nullopt;
  return std::max(*skin_to_ideal, *ideal_to_skin);
}

CutGeometry cut_geometry(const Setup& setup, const State& before, const State& after) {
  return cut_geometry(setup, before, after, swept_surface(setup, before.frame, after.frame));
}

CutGeometry cut_geometry(const Setup& setup, const State& before, const State& after,
                         const std::vector<Triangle>& surface) {
  const Body& body = setup.body;
  const double h = body.grid.spacing;
  CutGeometry geometry;
  if (!well_formed(setup, before).holds || !well_formed(setup, after).holds) {
    geometry.cut_area = geometry.lost_volume = std::numeric_limits<double>::quiet_NaN();
    return geometry;
  }
  for (std::size_t i = 0; i < before.alive.size(); ++i) geometry.lost_volume += before.alive[i] && !after.alive[i];
  const IdealCut ideal = ideal_cut(body, before, surface);
  geometry.cut_area = ideal.area;
  if (ideal.area > 0) {
    geometry.lost_per_area = geometry.lost_volume / ideal.area;
    geometry.least_per_area = static_cast<double>(least_removed(body, before, surface)) / ideal.area;
  }

  constexpr double kEdge = 0.25;  // [h]
  geometry.sampling_skin = kEdge / std::sqrt(3.0);
  // The lines along the axis with the greatest |n_a| >= 1/√3 meet the cut in points that are at most √3 farther apart
  // than the lines: no point of it is farther than half the diagonal of such a cell from one.
  geometry.sampling_ideal = std::sqrt(3.0) * std::sqrt(2.0) / 2 / kLinesPerSpacing;
  const NewSkin skin = new_skin(setup, before, after);
  if (skin.vertices.empty() || surface.empty()) return geometry;
  std::vector<Vec3> points = skin.vertices;
  const std::vector<Vec3> inner = points_of(skin.triangles, kEdge * h);
  points.insert(points.end(), inner.begin(), inner.end());
  const std::vector<double> apart = distances_to(surface, {}, points);
  double squares = 0;
  for (std::size_t v = 0; v < skin.vertices.size(); ++v) squares += apart[v] * apart[v];
  geometry.skin_rms = std::sqrt(squares / static_cast<double>(skin.vertices.size())) / h;
  geometry.skin_to_ideal = greatest_of(apart) / h;
  if (!ideal.samples.empty()) {
    geometry.ideal_to_skin = greatest_of(distances_to(skin.triangles, skin.vertices, ideal.samples)) / h;
  }
  return geometry;
}

}  // namespace cutproof::oracles
