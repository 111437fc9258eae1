// The shape of a cut beside the ideal one, and how far separated pieces stand in each other. Both count along lines
// parallel to the axes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "oracles/blade_motion.h"
#include "oracles/comparison/errors.h"
#include "oracles/oracles.h"
#include "oracles/support.h"
#include "oracles/surface/surface_distance.h"

namespace cutproof::oracles {

namespace {

using Triangle = std::array<Vec3, 3>;

// --- Lines parallel to an axis, through triangles --------------------------------------------------------------------

// The two other axes, so that (axis, u, v) is right-handed.
struct Axes {
  int axis, u, v;
};
Axes axes_of(int axis) { return {axis, (axis + 1) % 3, (axis + 2) % 3}; }

// Where a line meets a triangle.
struct Crossing {
  int64_t line = 0;
  double at = 0;      // coordinate along the axis
  double normal = 0;  // component of the triangle's unit normal along the axis
};

// Lines at first + (k + ½) spacing, k = 0 .. count - 1, along u and along v.
struct Lattice {
  Axes axes = axes_of(0);
  std::array<double, 2> first = {};
  std::array<int64_t, 2> count = {};
  std::array<double, 2> spacing = {};

  double place(int which, int64_t k) const {
    return first[at(which)] + (static_cast<double>(k) + 0.5) * spacing[at(which)];
  }
};

// On which side of the directed edge from p to q the point c lies, in the plane: +1 left, -1 right. A point on the edge
// is taken to be moved by (ε, ε²), so that of two triangles at an edge exactly one has it. Evaluated the same way for
// both directions of an edge.
int side_of(std::array<double, 2> p, std::array<double, 2> q, std::array<double, 2> c) {
  const bool reversed = q < p;
  if (reversed) std::swap(p, q);
  const double dx = q[0] - p[0], dy = q[1] - p[1];
  const double value = dx * (c[1] - p[1]) - dy * (c[0] - p[0]);
  const int side = value > 0 ? 1 : value < 0 ? -1 : dy != 0 ? (dy > 0 ? -1 : 1) : (dx > 0 ? 1 : -1);
  return reversed ? -side : side;
}

// Calls `see` with every crossing of a triangle.
template <class See>
void cross_lines(const Lattice& lattice, const Triangle& triangle, const See& see) {
  const auto [axis, u, v] = lattice.axes;
  std::array<std::array<double, 2>, 3> corner;
  std::array<double, 2> low, high;
  for (std::size_t k = 0; k < 3; ++k) {
    corner[k] = {triangle[k][u], triangle[k][v]};
    for (std::size_t w = 0; w < 2; ++w) {
      low[w] = k == 0 ? corner[k][w] : std::min(low[w], corner[k][w]);
      high[w] = k == 0 ? corner[k][w] : std::max(high[w], corner[k][w]);
    }
  }
  const Vec3 normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const double area = norm(normal);
  if (!(area > 0) || normal[axis] == 0 || !std::isfinite(area)) return;
  const auto range = [&](int which) {
    const double a = (low[at(which)] - lattice.first[at(which)]) / lattice.spacing[at(which)] - 0.5;
    const double b = (high[at(which)] - lattice.first[at(which)]) / lattice.spacing[at(which)] - 0.5;
    const auto most = static_cast<double>(lattice.count[at(which)]);
    return std::array<int64_t, 2>{static_cast<int64_t>(std::clamp(std::floor(a), 0.0, most)),
                                  static_cast<int64_t>(std::clamp(std::ceil(b) + 1, 0.0, most))};
  };
  const auto [u0, u1] = range(0);
  const auto [v0, v1] = range(1);
  for (int64_t j = v0; j < v1; ++j) {
    for (int64_t i = u0; i < u1; ++i) {
      const std::array<double, 2> c = {lattice.place(0, i), lattice.place(1, j)};
      const int side = side_of(corner[0], corner[1], c);
      if (side != side_of(corner[1], corner[2], c) || side != side_of(corner[2], corner[0], c)) continue;
      const double along =
          triangle[0][axis] - (normal[u] * (c[0] - corner[0][0]) + normal[v] * (c[1] - corner[0][1])) / normal[axis];
      see(Crossing{i + lattice.count[0] * j, along, normal[axis] / area});
    }
  }
}

// --- The ideal cut ---------------------------------------------------------------------------------------------------

// Turning is followed in pieces in which no point of the plate is off its way by more than this [h].
constexpr double kTurningSlack = 0.01;
// Crossings of one line that are nearer to each other than this, at right angles to the cut, are one [h]: what the
// blade passes twice, up to how finely its turning is followed.
constexpr double kSameCut = 0.05;

std::array<Vec3, 4> plate_of(const Blade& blade, const BladePose& pose) {
  const Vec3 half = (blade.length / 2) * pose.along, deep = blade.depth * pose.back;
  return {pose.edge - half, pose.edge + half, pose.edge + half + deep, pose.edge - half + deep};
}

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

// The fewest particles on any one direction of grid lines without which no edge along it crosses the surface. Edges of
// one line form paths; going up a path, the upper end of an edge serves the next one too.
int64_t least_removed(const Body& body, const State& before, const std::vector<Triangle>& surface) {
  const double h = body.grid.spacing;
  int64_t least = 0;
  for (int axis = 0; axis < 3; ++axis) {
    Lattice lattice{axes_of(axis), {-h / 2, -h / 2}, {}, {h, h}};
    lattice.count = {body.grid.nodes[at(lattice.axes.u)], body.grid.nodes[at(lattice.axes.v)]};
    std::vector<std::pair<int64_t, int64_t>> edges;  // line, lower node
    for (const Triangle& triangle : surface) {
      cross_lines(lattice, triangle, [&](const Crossing& c) {
        std::array<int64_t, 3> node;
        node[at(axis)] = static_cast<int64_t>(std::floor(c.at / h));
        node[at(lattice.axes.u)] = c.line % lattice.count[0];
        node[at(lattice.axes.v)] = c.line / lattice.count[0];
        std::array<int64_t, 3> upper = node;
        ++upper[at(axis)];
        if (is_tissue(body, before, node) && is_tissue(body, before, upper)) {
          edges.emplace_back(c.line, node[at(axis)]);
        }
      });
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    int64_t needed = 0;
    std::pair<int64_t, int64_t> taken = {-1, -1};
    for (const auto& edge : edges) {
      if (edge == taken) continue;  // its lower node is gone
      ++needed;
      taken = {edge.first, edge.second + 1};
    }
    least = std::max(least, needed);
  }
  return least;
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
    const auto& d = kDirections[skin.direction[v]];
    rest[v] = body.rest_position(i) + setup.skin.alpha * body.grid.spacing * Vec3{1.0 * d[0], 1.0 * d[1], 1.0 * d[2]};
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
  const double slack = kTurningSlack * setup.body.grid.spacing;
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
    // An arc of angle φ and radius r is off its chord by r φ² / 8.
    const double angle = turn_between(move.from, move.to).angle;
    const double radius = std::hypot(setup.blade.length / 2, setup.blade.depth);
    const int pieces = std::max(1, static_cast<int>(std::ceil(angle * std::sqrt(radius / (8 * slack)))));
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
  const Body& body = setup.body;
  const double h = body.grid.spacing;
  CutGeometry geometry;
  if (!well_formed(setup, before).holds || !well_formed(setup, after).holds) {
    geometry.cut_area = geometry.lost_volume = std::numeric_limits<double>::quiet_NaN();
    return geometry;
  }
  for (std::size_t i = 0; i < before.alive.size(); ++i) geometry.lost_volume += before.alive[i] && !after.alive[i];
  const std::vector<Triangle> surface = swept_surface(setup, before.frame, after.frame);
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
  std::vector<Vec3> points = points_of(skin.triangles, kEdge * h);
  points.insert(points.end(), skin.vertices.begin(), skin.vertices.end());
  geometry.skin_to_ideal = greatest_of(distances_to(surface, {}, points)) / h;
  if (!ideal.samples.empty()) {
    geometry.ideal_to_skin = greatest_of(distances_to(skin.triangles, skin.vertices, ideal.samples)) / h;
  }
  return geometry;
}

// --- Interpenetration ------------------------------------------------------------------------------------------------

namespace {

struct Box {
  std::array<double, 3> low, high;

  static Box of(const Triangle& t) {
    Box box;
    for (int k = 0; k < 3; ++k) {
      box.low[at(k)] = std::min({t[0][k], t[1][k], t[2][k]});
      box.high[at(k)] = std::max({t[0][k], t[1][k], t[2][k]});
    }
    return box;
  }
  void take(const Box& other) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], other.low[k]);
      high[k] = std::max(high[k], other.high[k]);
    }
  }
};

// The skins of the components of G, as triangles with their component.
struct Pieces {
  std::vector<Triangle> triangles;
  std::vector<int32_t> component;
  int32_t count = 0;
  bool in_order = true;  // every triangle belongs to a component and lies somewhere
};

Pieces pieces_of(const Setup& setup, const State& state) {
  Pieces pieces;
  pieces.in_order = well_formed(setup, state).holds;
  if (!pieces.in_order) return pieces;
  const Partition partition = graph_components(setup, state);
  pieces.count = partition.count;
  for (const auto& [a, b, c] : state.skin.triangles) {
    const Skin& skin = state.skin;
    pieces.triangles.push_back({skin.position[at(a)], skin.position[at(b)], skin.position[at(c)]});
    pieces.component.push_back(partition.label[at(skin.owner[at(a)])]);
    pieces.in_order = pieces.in_order && pieces.component.back() >= 0 && is_finite(skin.position[at(a)]) &&
                      is_finite(skin.position[at(b)]) && is_finite(skin.position[at(c)]);
  }
  return pieces;
}

// Where more than one component may be: where the boxes of two overlap.
std::optional<Box> shared_region(const Pieces& pieces) {
  std::vector<std::optional<Box>> box(at(pieces.count));
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    auto& of_piece = box[at(pieces.component[t])];
    const Box here = Box::of(pieces.triangles[t]);
    if (of_piece) {
      of_piece->take(here);
    } else {
      of_piece = here;
    }
  }
  std::optional<Box> region;
  for (std::size_t a = 0; a < box.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (!box[a] || !box[b]) continue;
      Box shared;
      bool empty = false;
      for (std::size_t k = 0; k < 3; ++k) {
        shared.low[k] = std::max(box[a]->low[k], box[b]->low[k]);
        shared.high[k] = std::min(box[a]->high[k], box[b]->high[k]);
        empty = empty || shared.low[k] >= shared.high[k];
      }
      if (empty) continue;
      if (region) {
        region->take(shared);
      } else {
        region = shared;
      }
    }
  }
  return region;
}

// A part of a line, or of the column around it, in which a component is, or its skin.
struct Stretch {
  int64_t line;
  double low, high;
  int32_t component;
  bool skin;  // else: the line is inside the component
};

// Lines that divide the region evenly, at most `spacing` apart.
Lattice lattice_over(const Box& region, int axis, double spacing) {
  Lattice lattice{axes_of(axis), {}, {}, {}};
  for (int w = 0; w < 2; ++w) {
    const auto k = at(w == 0 ? lattice.axes.u : lattice.axes.v);
    lattice.first[at(w)] = region.low[k];
    const double width = region.high[k] - region.low[k];
    lattice.count[at(w)] = static_cast<int64_t>(std::ceil(width / spacing));
    lattice.spacing[at(w)] = width / static_cast<double>(lattice.count[at(w)]);
  }
  return lattice;
}

// Inside is where the skin has been entered more often than left.
void add_insides(const Pieces& pieces, const Lattice& lattice, std::vector<Stretch>& stretches) {
  struct Entry {
    int64_t line;
    int32_t component;
    double at;
    int step;  // +1: enters, going up
  };
  std::vector<Entry> entries;
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    cross_lines(lattice, pieces.triangles[t], [&](const Crossing& c) {
      entries.push_back({c.line, pieces.component[t], c.at, c.normal < 0 ? +1 : -1});
    });
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.line, a.component, a.at) < std::tie(b.line, b.component, b.at);
  });
  int winding = 0;
  for (std::size_t k = 0; k + 1 < entries.size(); ++k) {
    const Entry &here = entries[k], &next = entries[k + 1];
    winding += here.step;
    if (here.line != next.line || here.component != next.component) {
      winding = 0;
    } else if (winding > 0 && next.at > here.at) {
      stretches.push_back({here.line, here.at, next.at, here.component, false});
    }
  }
}

// Where triangles pass through columns: no less than they do. Over the column's square the triangle's plane lies within
// |n_u| s_u / 2 + |n_v| s_v / 2 of its height over the middle, times |n_axis|.
void add_skins(const Pieces& pieces, const Lattice& lattice, std::vector<Stretch>& stretches) {
  const auto [axis, u, v] = lattice.axes;
  for (std::size_t t = 0; t < pieces.triangles.size(); ++t) {
    const Triangle& triangle = pieces.triangles[t];
    const Box box = Box::of(triangle);
    const Vec3 n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    const double half = (std::abs(n[u]) * lattice.spacing[0] + std::abs(n[v]) * lattice.spacing[1]) / 2;
    std::array<int64_t, 2> first, end;
    for (std::size_t w = 0; w < 2; ++w) {
      const auto k = at(w == 0 ? u : v);
      const auto most = static_cast<double>(lattice.count[w]);
      const auto column = [&](double x) { return (x - lattice.first[w]) / lattice.spacing[w]; };
      first[w] = static_cast<int64_t>(std::clamp(std::floor(column(box.low[k])), 0.0, most));
      end[w] = static_cast<int64_t>(std::clamp(std::floor(column(box.high[k])) + 1, 0.0, most));
    }
    for (int64_t j = first[1]; j < end[1]; ++j) {
      for (int64_t i = first[0]; i < end[0]; ++i) {
        // On the plane: n_axis (z − z0) = −aside, up to half.
        const double aside =
            n[u] * (lattice.place(0, i) - triangle[0][u]) + n[v] * (lattice.place(1, j) - triangle[0][v]);
        double low = box.low[at(axis)], high = box.high[at(axis)];
        if (n[axis] == 0) {
          if (std::abs(aside) > half) continue;
        } else {
          const double middle = triangle[0][axis] - aside / n[axis], reach = half / std::abs(n[axis]);
          low = std::max(low, middle - reach);
          high = std::min(high, middle + reach);
        }
        if (low < high) stretches.push_back({i + lattice.count[0] * j, low, high, pieces.component[t], true});
      }
    }
  }
}

// Lengths, over all lines, of what lies in more than one component, and of that of which the column around the line may
// be of another opinion: where more than one component is present and the skin of one of them passes.
struct Lengths {
  double shared = 0, doubtful = 0;
};
Lengths lengths_of(std::vector<Stretch> stretches, int32_t components) {
  std::sort(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) { return a.line < b.line; });
  struct End {
    double at;
    int step;
    int32_t component;
    bool skin;
  };
  std::vector<std::array<int32_t, 2>> depth(at(components));  // inside, skin
  Lengths lengths;
  std::vector<End> ends;
  for (std::size_t begin = 0, end; begin < stretches.size(); begin = end) {
    ends.clear();
    for (end = begin; end < stretches.size() && stretches[end].line == stretches[begin].line; ++end) {
      const Stretch& s = stretches[end];
      ends.push_back({s.low, +1, s.component, s.skin});
      ends.push_back({s.high, -1, s.component, s.skin});
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.at < b.at; });
    int inside = 0, skins = 0, present = 0;  // how many components
    for (std::size_t k = 0; k < ends.size(); ++k) {
      auto& [in, on] = depth[at(ends[k].component)];
      const bool was_in = in > 0, was_on = on > 0;
      (ends[k].skin ? on : in) += ends[k].step;
      inside += (in > 0) - was_in;
      skins += (on > 0) - was_on;
      present += (in > 0 || on > 0) - (was_in || was_on);
      if (k + 1 == ends.size()) break;
      const double length = ends[k + 1].at - ends[k].at;
      if (inside > 1) lengths.shared += length;
      if (present > 1 && skins > 0) lengths.doubtful += length;
    }
  }
  return lengths;
}

}  // namespace

Interpenetration interpenetration(const Setup& setup, const State& state) {
  const Pieces pieces = pieces_of(setup, state);
  if (!pieces.in_order) {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  }
  const std::optional<Box> region = shared_region(pieces);
  if (!region) return {};
  const double h = setup.body.grid.spacing, cube = h * h * h;
  Interpenetration best;
  best.bound = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const Lattice lattice = lattice_over(*region, axis, h / kColumnsPerSpacing);
    std::vector<Stretch> stretches;
    add_insides(pieces, lattice, stretches);
    add_skins(pieces, lattice, stretches);
    const Lengths lengths = lengths_of(std::move(stretches), pieces.count);
    const double column = lattice.spacing[0] * lattice.spacing[1] / cube;
    if (lengths.doubtful * column < best.bound) best = {lengths.shared * column, lengths.doubtful * column};
  }
  return best;
}

}  // namespace cutproof::oracles
