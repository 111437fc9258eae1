// The surface around the living particles of a grid, such as marching cubes makes it: judged from its vertices and
// triangles alone.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "guests/questions/kinds.h"
#include "model/at.h"

namespace cutproof::guests {

namespace {

Question draw_surface(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const auto kinds = static_cast<int64_t>(grid_kinds().size());
  return {grid_kinds()[at(index % kinds)], arrays_of(draw_on_grid(random, index % kinds)), {}};
}

Verdict begin(std::string_view property, std::string_view source) {
  Verdict verdict;
  verdict.property = property;
  verdict.bound_source = source;
  verdict.unit = "1";
  return verdict;
}

void fail(Verdict& verdict, std::vector<int32_t> particles, std::string text) {
  verdict.measured += 1;
  if (!verdict.holds) return;
  verdict.holds = false;
  verdict.witness = {{}, std::move(particles), {}, std::move(text)};
}

// Groups of what is joined.
class Groups {
 public:
  explicit Groups(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t of(std::size_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::size_t a, std::size_t b) { parent_[of(a)] = of(b); }

 private:
  std::vector<std::size_t> parent_;
};

// The grid with who lives where, and both ways of joining what meets across the diagonal of a face.
struct Occupancy {
  explicit Occupancy(const Tissue& tissue) : grid(tissue.body.grid), living(at(grid.node_count()), 0) {
    for (std::size_t i = 0; i < tissue.alive.size(); ++i) living[at(tissue.body.node[i])] = tissue.alive[i];
  }
  bool inside(const std::array<int32_t, 3>& n) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (n[axis] < 0 || n[axis] >= grid.nodes[axis]) return false;
    }
    return true;
  }
  // Groups of the nodes that are `living`, or not, joined across faces of cells too, or along edges only.
  Groups groups(bool alive, bool across_faces) const {
    Groups groups(living.size());
    for (std::size_t k = 0; k < living.size(); ++k) {
      if ((living[k] != 0) != alive) continue;
      const auto node = grid.coordinates(static_cast<int64_t>(k));
      for (int32_t z = -1; z <= 1; ++z) {
        for (int32_t y = -1; y <= 1; ++y) {
          for (int32_t x = -1; x <= 1; ++x) {
            const int32_t steps = std::abs(x) + std::abs(y) + std::abs(z);
            const std::array<int32_t, 3> next = {node[0] + x, node[1] + y, node[2] + z};
            if (steps == 0 || steps > (across_faces ? 2 : 1) || !inside(next)) continue;
            const auto other = at(grid.index(next[0], next[1], next[2]));
            if (living[other] == living[k]) groups.join(k, other);
          }
        }
      }
    }
    return groups;
  }
  Grid grid;
  std::vector<uint8_t> living;  // [node]
};

// What a polarity makes of a body: components, and cavities in them.
struct Topology {
  Topology(const Occupancy& nodes, bool tissue_across_faces) : component(nodes.groups(true, tissue_across_faces)) {
    Groups empty = nodes.groups(false, !tissue_across_faces);
    std::map<std::size_t, int> components, cavities;
    const std::size_t outside = empty.of(0);  // the ring around the tissue
    for (std::size_t k = 0; k < nodes.living.size(); ++k) {
      if (nodes.living[k] != 0) ++components[component.of(k)];
      if (nodes.living[k] == 0 && empty.of(k) != outside) ++cavities[empty.of(k)];
    }
    outer = static_cast<int64_t>(components.size());
    inner = static_cast<int64_t>(cavities.size());
  }
  Groups component;  // of nodes
  int64_t outer = 0, inner = 0;
};

struct Vertex {
  int64_t node = -1;  // the living end of the grid edge on which it lies; -1: on none
  int64_t edge = -1;  // 3 · lower node + axis
};

struct Surface {
  std::vector<Vec3> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  std::vector<Vertex> placed;
};

void check_vertices(Surface& surface, const Occupancy& nodes, Precision precision, Verdict& verdict) {
  const double h = nodes.grid.spacing;
  std::map<int64_t, std::size_t> vertex_on;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    ++verdict.checked;
    const Vec3 p = surface.vertices[v];
    std::array<double, 3> q = {p.x / h, p.y / h, p.z / h};
    Vertex& placed = surface.placed.emplace_back();
    const std::string where = fmt::format("vertex {} at ({:g}, {:g}, {:g}) spacings", v, q[0], q[1], q[2]);
    if (!std::isfinite(q[0] + q[1] + q[2])) {
      fail(verdict, {}, where + " is not finite, or was not written");
      continue;
    }
    // A product of a whole number and h, a few sums: each rounded relative to the place.
    const double greatest = std::max({std::abs(q[0]), std::abs(q[1]), std::abs(q[2]), 1.0});
    const double tolerance = 8 * unit_roundoff(precision) * greatest;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (std::abs(q[k] - std::round(q[k])) > std::abs(q[axis] - std::round(q[axis]))) axis = k;
    }
    std::array<int32_t, 3> low = {0, 0, 0};
    bool on_edge = std::abs(q[axis] - std::round(q[axis])) > tolerance;
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::abs(q[k]) > 1e9) on_edge = false;
      if (!on_edge) break;
      low[k] = static_cast<int32_t>(k == axis ? std::floor(q[k]) : std::round(q[k]));
      if (k != axis && std::abs(q[k] - std::round(q[k])) > tolerance) on_edge = false;
    }
    std::array<int32_t, 3> high = low;
    ++high[axis];
    if (!on_edge || !nodes.inside(low) || !nodes.inside(high)) {
      fail(verdict, {}, where + " lies between the ends of no edge of the grid");
      continue;
    }
    const int64_t below = nodes.grid.index(low[0], low[1], low[2]), above = nodes.grid.index(high[0], high[1], high[2]);
    if (nodes.living[at(below)] == nodes.living[at(above)]) {
      fail(verdict, {},
           where + (nodes.living[at(below)] != 0 ? " lies inside the tissue" : " lies outside the tissue"));
      continue;
    }
    placed.node = nodes.living[at(below)] != 0 ? below : above;
    placed.edge = 3 * below + static_cast<int64_t>(axis);
    const auto [known, is_new] = vertex_on.try_emplace(placed.edge, v);
    if (!is_new) {
      fail(verdict, {},
           fmt::format("{} and vertex {} lie on the same edge of the grid: vertices are to be shared", where,
                       known->second));
    }
  }
  // Each edge between a living and an empty node has its vertex.
  for (int64_t k = 0; k < nodes.grid.node_count(); ++k) {
    const auto node = nodes.grid.coordinates(k);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto next = node;
      ++next[axis];
      if (!nodes.inside(next)) continue;
      const int64_t other = nodes.grid.index(next[0], next[1], next[2]);
      if (nodes.living[at(k)] == nodes.living[at(other)]) continue;
      ++verdict.checked;
      if (vertex_on.contains(3 * k + static_cast<int64_t>(axis))) continue;
      fail(verdict, {},
           fmt::format("the grid edge from node ({}, {}, {}) along {} leaves the tissue, and has no vertex", node[0],
                       node[1], node[2], "xyz"[axis]));
    }
  }
}

// Closed, oriented, 2-manifold: each directed edge once, its opposite once; the triangles at a vertex form one fan.
void check_surface(const Surface& surface, Verdict& verdict) {
  std::map<std::array<int32_t, 2>, std::array<int32_t, 2>> triangle_at;  // (a, b) -> triangle, third vertex
  std::vector<int64_t> around(surface.vertices.size(), 0);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    ++verdict.checked;
    const auto& [a, b, c] = surface.triangles[t];
    if (a == b || b == c || c == a) {
      fail(verdict, {}, fmt::format("triangle {} names a vertex twice: {}, {}, {}", t, a, b, c));
      return;
    }
    for (const auto& [from, to, third] : {std::array{a, b, c}, std::array{b, c, a}, std::array{c, a, b}}) {
      ++around[at(from)];
      const auto [known, is_new] = triangle_at.try_emplace({from, to}, std::array{static_cast<int32_t>(t), third});
      if (is_new) continue;
      fail(verdict, {},
           fmt::format("triangles {} and {} both run from vertex {} to vertex {}: one is flipped or doubled, or more "
                       "than two triangles meet there",
                       known->second[0], t, from, to));
      return;
    }
  }
  for (const auto& [edge, triangle] : triangle_at) {
    if (triangle_at.contains({edge[1], edge[0]})) continue;
    fail(verdict, {},
         fmt::format("the surface is open: triangle {} runs from vertex {} to vertex {}, and none runs back",
                     triangle[0], edge[0], edge[1]));
    return;
  }
  for (const auto& [edge, triangle] : triangle_at) {
    if (around[at(edge[0])] <= 0) continue;  // seen
    int64_t fan = 0;
    int32_t to = edge[1];
    do {
      ++fan;
      to = triangle_at.at({edge[0], to})[1];
    } while (to != edge[1] && fan <= around[at(edge[0])]);
    if (fan != around[at(edge[0])]) {
      fail(verdict, {},
           fmt::format("the surface is pinched at vertex {}: of the {} triangles that meet there, {} lie in "
                       "one fan",
                       edge[0], around[at(edge[0])], fan));
      return;
    }
    around[at(edge[0])] = -1;
  }
  for (std::size_t v = 0; v < around.size(); ++v) {
    if (around[v] == 0) return fail(verdict, {}, fmt::format("no triangle uses vertex {}", v));
  }
}

struct Shells {
  int64_t outer = 0, inner = 0, joining = 0, inside_out = 0;
};

// By the sign of the volume; `joining`: shells on which components of this topology meet; `inside_out`: those whose
// triangles turn the wrong way. Which way is right shows at the vertex that lies farthest along x (oracles/shells.h).
Shells count_shells(const Surface& surface, const Occupancy& nodes, Topology& topology) {
  Groups groups(surface.vertices.size());
  for (const auto& [a, b, c] : surface.triangles) {
    groups.join(at(a), at(b));
    groups.join(at(b), at(c));
  }
  std::map<std::size_t, double> volume;
  std::map<std::size_t, std::size_t> component, farthest;
  std::map<std::size_t, bool> joins;
  for (const auto& [a, b, c] : surface.triangles) {
    const std::size_t shell = groups.of(at(a));
    volume[shell] += dot(surface.vertices[at(a)], cross(surface.vertices[at(b)], surface.vertices[at(c)]));
    for (const int32_t v : {a, b, c}) {
      const std::size_t of = topology.component.of(at(surface.placed[at(v)].node));
      if (component.try_emplace(shell, of).first->second != of) joins[shell] = true;
      std::size_t& last = farthest.try_emplace(shell, at(v)).first->second;
      if (surface.vertices[at(v)].x > surface.vertices[last].x) last = at(v);
    }
  }
  Shells shells;
  for (const auto& [shell, six_volumes] : volume) {
    ++(six_volumes > 0 ? shells.outer : shells.inner);
    const Vertex& last = surface.placed[farthest.at(shell)];
    const bool around_tissue = nodes.living[at(last.edge / 3)] != 0;  // the lower end of its edge
    if (around_tissue != (six_volumes > 0)) ++shells.inside_out;
  }
  shells.joining = static_cast<int64_t>(joins.size());
  return shells;
}

void check_shells(const Surface& surface, const Occupancy& nodes, Verdict& verdict) {
  Topology own(nodes, false), other(nodes, true);
  const Shells shells = count_shells(surface, nodes, own);
  verdict.checked = own.outer + own.inner;
  verdict.measured = static_cast<double>(std::abs(shells.outer - own.outer) + std::abs(shells.inner - own.inner) +
                                         shells.joining + shells.inside_out);
  if (verdict.measured == 0) return;
  verdict.holds = false;
  std::string text = fmt::format("{} outer and {} inner shells around {} components with {} cavities", shells.outer,
                                 shells.inner, own.outer, own.inner);
  if (shells.joining > 0) text += fmt::format("; {} shells go around several components", shells.joining);
  const Shells in_other = count_shells(surface, nodes, other);
  if (in_other.outer == other.outer && in_other.inner == other.inner && in_other.joining == 0 &&
      in_other.inside_out == 0) {
    text += fmt::format(
        ". It is right in the other polarity ({} components, {} cavities): it joins living nodes that meet only across "
        "the diagonal of a face, where no edge joins the tissue; take the cases with inside and outside exchanged",
        other.outer, other.inner);
  } else if (shells.inside_out > 0) {
    text +=
        fmt::format(". {} shells are inside out: triangles are to be counter-clockwise seen from outside the tissue",
                    shells.inside_out);
  }
  verdict.witness.text = text;
}

std::string problem_on_grid(const Question& question) {
  return find_array(question.given, "node") == nullptr ? "'node' is missing" : problem_of_body(question);
}

std::vector<Verdict> judge_surface(const Question& question, const Arrays& answers, Precision precision) {
  const Tissue tissue = tissue_of(question.given);
  const Occupancy nodes(tissue);
  Verdict vertices = begin("surface vertices", "method.md §8: one vertex on each grid edge that leaves the tissue"),
          closed = begin("surface", "method.md §8: closed, oriented, 2-manifold"),
          shells = begin("surface shells", "method.md §8, lemma");
  Surface surface;
  const Array &points = answers[0], &corners = answers[1];
  for (int64_t v = 0; v < points.rows(); ++v) {
    surface.vertices.push_back({points.number(3 * v), points.number(3 * v + 1), points.number(3 * v + 2)});
  }
  for (int64_t t = 0; t < corners.rows(); ++t) {
    std::array<int32_t, 3>& triangle = surface.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      triangle[k] = static_cast<int32_t>(corners.integer(3 * t + static_cast<int64_t>(k)));
      if (triangle[k] < 0 || triangle[k] >= points.rows()) {
        return {unreadable(
            "surface", fmt::format("triangle {} names vertex {}, and there are {}", t, triangle[k], points.rows()))};
      }
    }
  }
  check_vertices(surface, nodes, precision, vertices);
  check_surface(surface, closed);
  if (!vertices.holds || !closed.holds) {
    shells.vacuous = "what is no surface has no shells";
  } else {
    check_shells(surface, nodes, shells);
  }
  for (Verdict* const verdict : {&vertices, &closed, &shells}) {
    if (verdict->checked == 0 && verdict->holds && verdict->vacuous.empty()) verdict->vacuous = "nothing is alive";
  }
  return {vertices, closed, shells};
}

constexpr AnswerArray kSurfaceAnswers[] = {
    {.name = "vertices", .real = true, .columns = 3, .text = "places [m]: the living node plus a part of an edge"},
    {.name = "triangles", .type = ElementType::i32, .columns = 3, .text = "counter-clockwise seen from outside"}};

}  // namespace

std::array<int64_t, 2> shells_around(const Tissue& tissue) {
  const Topology topology(Occupancy(tissue), false);
  return {topology.outer, topology.inner};
}

const OperationDescription kSurface = {
    .number = wire::surface,
    .name = "surface",
    .text = "a closed surface around the living nodes of a grid",
    .by_itself = "skin",
    .answers = kSurfaceAnswers,
    .cases = "bodies",
    .draw = draw_surface,
    .cases_of = one_body,
    .size_of = size_of_body,
    .judge = judge_surface,
    .problem = problem_on_grid,
    .simpler = fewer_particles,
    .kinds = grid_kinds,
};

}  // namespace cutproof::guests
