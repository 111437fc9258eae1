// The surface around the living particles of a grid, such as marching cubes makes it: judged from its vertices and
// triangles alone.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

#include "guests/questions/kinds.h"
#include "model/at.h"

namespace cutproof::guests {

namespace {

Question draw_surface(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const auto kinds = static_cast<int64_t>(grid_kinds().size());
  return {grid_kinds()[at(index % kinds)], arrays_of(draw_on_grid(random, index % kinds)), {}};
}

// Cells number 10⁵ and vertices more than 2¹⁶. The least size shows how the time of an answer grows.
constexpr int64_t kSurfaceSizes[] = {4'097, 65'537, 100'000};

Question draw_large_surface(uint64_t seed, int64_t kind, int64_t size, Precision) {
  Random random(large_seed(seed, kind));
  return {
      large_grid_kinds()[at(kind)], arrays_of(draw_large_on_grid(random, kind, static_cast<int32_t>(size))), {}, size};
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

// Groups of joined items.
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

// The grid with its living nodes, and both ways of joining nodes across the diagonal of a face.
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

// Components and cavities of a body under a polarity.
struct Topology {
  Topology(const Occupancy& nodes, bool tissue_across_faces)
      : component(nodes.groups(true, tissue_across_faces)), empty(nodes.groups(false, !tissue_across_faces)) {
    const std::size_t outside = empty.of(0);  // the ring around the tissue
    for (std::size_t k = 0; k < nodes.living.size(); ++k) {
      if (nodes.living[k] != 0 && component.of(k) == k) ++outer;
      if (nodes.living[k] == 0 && empty.of(k) == k && k != outside) ++inner;
    }
  }
  Groups component, empty;  // of nodes
  int64_t outer = 0, inner = 0;
};

struct Surface {
  std::vector<Vec3> vertices;  // [h]
  std::vector<std::array<int32_t, 3>> triangles;
};

std::string place_in_words(std::size_t v, Vec3 q) {
  return fmt::format("vertex {} at ({:g}, {:g}, {:g}) spacings", v, q.x, q.y, q.z);
}

// Of a coordinate [h]: a product of a whole number and h, a few sums, each rounded relative to the place.
double place_tolerance(Vec3 q, Precision precision) {
  return 8 * unit_roundoff(precision) * std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), 1.0});
}

// A requirement on every surface around the tissue, for any method: each vertex lies in a cell that has living corners
// and empty ones (its boundary included, within rounding).
void check_places(const Surface& surface, const Occupancy& nodes, Precision precision, Verdict& verdict) {
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    ++verdict.checked;
    const Vec3 q = surface.vertices[v];
    if (!std::isfinite(q.x + q.y + q.z)) {
      fail(verdict, {}, place_in_words(v, q) + " is not finite, or was not written");
      continue;
    }
    const double tolerance = place_tolerance(q, precision);
    std::array<int32_t, 3> first = {}, last = {};  // cells that it may lie in, by their lowest nodes
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto cell = [&](double of) {
        return static_cast<int32_t>(std::clamp(std::floor(of), -2.0, nodes.grid.nodes[axis] + 1.0));
      };
      const double of = std::array{q.x, q.y, q.z}[axis];
      // On the plane between two cells it is in both.
      first[axis] = cell(std::ceil(of - tolerance) - 1);
      last[axis] = cell(of + tolerance);
    }
    bool alive = false, empty = false, both = false;
    for (int32_t z = first[2]; z <= last[2] && !both; ++z) {
      for (int32_t y = first[1]; y <= last[1] && !both; ++y) {
        for (int32_t x = first[0]; x <= last[0] && !both; ++x) {
          bool lives = false, dead = false;
          for (int corner = 0; corner < 8; ++corner) {
            const std::array<int32_t, 3> node = {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)};
            const bool living =
                nodes.inside(node) && nodes.living[at(nodes.grid.index(node[0], node[1], node[2]))] != 0;
            (living ? lives : dead) = true;
          }
          both = lives && dead;
          alive = alive || lives;
          empty = empty || dead;
        }
      }
    }
    if (both) continue;
    fail(verdict, {},
         place_in_words(v, q) + (alive && !empty ? " lies inside the tissue, in a cell without an empty corner"
                                                 : " lies outside the tissue, in a cell without a living corner"));
  }
}

// A further requirement on marching cubes: one vertex on each grid edge that leaves the tissue.
void check_vertices(const Surface& surface, const Occupancy& nodes, Precision precision, Verdict& verdict) {
  std::vector<int32_t> vertex_on(3 * nodes.living.size(), -1);  // by edge: 3 · lower node + axis
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    ++verdict.checked;
    const Vec3 place = surface.vertices[v];
    const std::array<double, 3> q = {place.x, place.y, place.z};
    const auto where = [&] { return place_in_words(v, place); };
    if (!std::isfinite(q[0] + q[1] + q[2])) {
      fail(verdict, {}, where() + " is not finite, or was not written");
      continue;
    }
    const double tolerance = place_tolerance(place, precision);
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
      fail(verdict, {}, where() + " lies between the ends of no edge of the grid");
      continue;
    }
    const int64_t below = nodes.grid.index(low[0], low[1], low[2]), above = nodes.grid.index(high[0], high[1], high[2]);
    if (nodes.living[at(below)] == nodes.living[at(above)]) {
      fail(verdict, {},
           where() + (nodes.living[at(below)] != 0 ? " lies inside the tissue" : " lies outside the tissue"));
      continue;
    }
    int32_t& known = vertex_on[3 * at(below) + axis];
    if (known >= 0) {
      fail(verdict, {},
           fmt::format("{} and vertex {} lie on the same edge of the grid: vertices are to be shared", where(), known));
      continue;
    }
    known = static_cast<int32_t>(v);
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
      if (vertex_on[3 * at(k) + axis] >= 0) continue;
      fail(verdict, {},
           fmt::format("the grid edge from node ({}, {}, {}) along {} leaves the tissue, and has no vertex", node[0],
                       node[1], node[2], "xyz"[axis]));
    }
  }
}

// Of triangle (from, to, third), an edge that leaves `from`.
struct Half {
  int32_t from, to, third, triangle;
  friend auto operator<=>(const Half&, const Half&) = default;
};

// Closed, oriented, 2-manifold: each directed edge once, its opposite once; the triangles at a vertex form one fan.
void check_surface(const Surface& surface, Verdict& verdict) {
  std::vector<Half> halves;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    ++verdict.checked;
    const auto& [a, b, c] = surface.triangles[t];
    if (a == b || b == c || c == a) {
      return fail(verdict, {}, fmt::format("triangle {} names a vertex twice: {}, {}, {}", t, a, b, c));
    }
    const auto triangle = static_cast<int32_t>(t);
    halves.insert(halves.end(), {{a, b, c, triangle}, {b, c, a, triangle}, {c, a, b, triangle}});
  }
  std::sort(halves.begin(), halves.end());
  const auto same = std::adjacent_find(halves.begin(), halves.end(), [](const Half& one, const Half& other) {
    return one.from == other.from && one.to == other.to;
  });
  if (same != halves.end()) {
    const auto& [first, second] = std::minmax(same->triangle, (same + 1)->triangle);
    return fail(verdict, {},
                fmt::format("triangles {} and {} both run from vertex {} to vertex {}: one is flipped or doubled, or "
                            "more than two triangles meet there",
                            first, second, same->from, same->to));
  }
  const auto half = [&](int32_t from, int32_t to) -> const Half* {
    const auto found = std::lower_bound(halves.begin(), halves.end(), Half{from, to, -1, -1});
    return found != halves.end() && found->from == from && found->to == to ? &*found : nullptr;
  };
  for (const Half& each : halves) {
    if (half(each.to, each.from) != nullptr) continue;
    return fail(verdict, {},
                fmt::format("the surface is open: triangle {} runs from vertex {} to vertex {}, and none runs back",
                            each.triangle, each.from, each.to));
  }
  std::vector<uint8_t> used(surface.vertices.size(), 0);
  for (std::size_t first = 0; first < halves.size();) {
    const int32_t v = halves[first].from;
    std::size_t end = first;
    while (end < halves.size() && halves[end].from == v) ++end;
    used[at(v)] = 1;
    std::size_t fan = 0;
    int32_t to = halves[first].to;
    do {
      ++fan;
      to = half(v, to)->third;
    } while (to != halves[first].to && fan <= end - first);
    if (fan != end - first) {
      return fail(verdict, {},
                  fmt::format("the surface is pinched at vertex {}: of the {} triangles that meet there, {} lie in "
                              "one fan",
                              v, end - first, fan));
    }
    first = end;
  }
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) return fail(verdict, {}, fmt::format("no triangle uses vertex {}", v));
  }
}

// --- Shells ----------------------------------------------------------------------------------------------------------

// Where a triangle crosses a line of nodes along x.
struct Crossing {
  int64_t line;      // the line's node with x = 0
  double x, within;  // [h] where, and how far rounding may carry it
  int32_t shell;
  int32_t turn;  // 1: the surface encloses the space behind it; -1: the space before it
};

// Of an edge, where it crosses the plane y = j: the same for both of its triangles, whose sum over a closed surface is
// therefore 0 on every line, whatever is rounded.
std::array<double, 2> place_on_plane(const Surface& surface, int32_t a, int32_t b, double j) {
  const Vec3 &p = surface.vertices[at(std::min(a, b))], &q = surface.vertices[at(std::max(a, b))];
  const double t = (j - p.y) / (q.y - p.y);
  return {p.x + t * (q.x - p.x), p.z + t * (q.z - p.z)};
}

// Every crossing of a line by a triangle, along each line. Nodes on a triangle's rim are counted as if they lay a
// little above it in y and z.
std::vector<Crossing> crossings_of(const Surface& surface, const Grid& grid, Groups& shells, Precision precision) {
  std::vector<Crossing> crossings;
  for (const auto& triangle : surface.triangles) {
    double low = surface.vertices[at(triangle[0])].y, high = low;
    for (const int32_t v : triangle) {
      low = std::min(low, surface.vertices[at(v)].y);
      high = std::max(high, surface.vertices[at(v)].y);
    }
    for (double j = std::max(std::ceil(low), 0.0); j < high && j < grid.nodes[1]; ++j) {
      std::array<double, 2> up = {}, down = {};  // x and z of the edges that run towards greater y, and back
      for (std::size_t k = 0; k < 3; ++k) {
        const int32_t a = triangle[k], b = triangle[(k + 1) % 3];
        const bool from_below = surface.vertices[at(a)].y <= j, to_below = surface.vertices[at(b)].y <= j;
        if (from_below != to_below) (from_below ? up : down) = place_on_plane(surface, a, b, j);
      }
      const double least = std::min(up[1], down[1]), most = std::max(up[1], down[1]);
      for (double k = std::max(std::ceil(least), 0.0); k < most && k < grid.nodes[2]; ++k) {
        const double part = (k - up[1]) / (down[1] - up[1]), apart = std::abs(down[0] - up[0]);
        const double tolerance = place_tolerance(surface.vertices[at(triangle[0])], precision);
        crossings.push_back({grid.index(0, static_cast<int32_t>(j), static_cast<int32_t>(k)),
                             up[0] + std::clamp(part, 0.0, 1.0) * (down[0] - up[0]),
                             tolerance + std::min(1.0, tolerance / (most - least)) * apart,
                             static_cast<int32_t>(shells.of(at(triangle[0]))), down[1] < up[1] ? 1 : -1});
      }
    }
  }
  std::sort(crossings.begin(), crossings.end(),
            [](const Crossing& a, const Crossing& b) { return std::pair(a.line, a.x) < std::pair(b.line, b.x); });
  return crossings;
}

// A shell between a living node and the empty one beside it.
struct Between {
  int32_t shell;
  int64_t living, empty;
};

struct Sides {
  std::vector<Between> between;
  int64_t outer = 0, inner = 0;           // shells, by the sign of their volume
  int64_t checked = 0, inconclusive = 0;  // nodes; on the surface within rounding
  int64_t wrong = 0, inside_out = 0;      // nodes; shells whose triangles turn the wrong way
  std::string first_wrong;
};

Sides sides_of(const Surface& surface, const Occupancy& nodes, Precision precision) {
  Sides sides;
  Groups shells(surface.vertices.size());
  for (const auto& [a, b, c] : surface.triangles) {
    shells.join(at(a), at(b));
    shells.join(at(b), at(c));
  }
  std::vector<double> volume(surface.vertices.size(), 0);
  for (const auto& [a, b, c] : surface.triangles) {
    volume[shells.of(at(a))] += dot(surface.vertices[at(a)], cross(surface.vertices[at(b)], surface.vertices[at(c)]));
  }
  std::vector<uint8_t> turned(surface.vertices.size(), 0);
  for (std::size_t v = 0; v < volume.size(); ++v) {
    if (shells.of(v) == v) ++(volume[v] > 0 ? sides.outer : sides.inner);
  }
  const std::vector<Crossing> crossings = crossings_of(surface, nodes.grid, shells, precision);
  auto next = crossings.begin();
  const int32_t length = nodes.grid.nodes[0];
  for (int64_t line = 0; line < nodes.grid.node_count(); line += length) {
    int32_t around = 0;                         // how often the surface goes around the node
    std::vector<std::array<int32_t, 2>> since;  // the last node: shells and their turns
    const auto end = std::find_if(next, crossings.end(), [&](const Crossing& c) { return c.line != line; });
    for (int32_t i = 0; i < length; ++i) {
      const int64_t node = line + i;
      const bool lives = nodes.living[at(node)] != 0;
      for (; next != end && next->x <= i; ++next) {
        around += next->turn;
        const auto known = std::find_if(since.begin(), since.end(), [&](const auto& s) { return s[0] == next->shell; });
        if (known == since.end()) {
          since.push_back({next->shell, next->turn});
        } else {
          (*known)[1] += next->turn;
        }
      }
      ++sides.checked;
      const auto touches = [&](const Crossing& c) { return std::abs(c.x - i) <= c.within; };
      if ((next != end && touches(*next)) ||
          (next != crossings.begin() && (next - 1)->line == line && touches(*(next - 1)))) {
        ++sides.inconclusive;
      } else if (around != (lives ? 1 : 0)) {
        ++sides.wrong;
        if (sides.first_wrong.empty()) {
          const auto [x, y, z] = nodes.grid.coordinates(node);
          sides.first_wrong = fmt::format("node ({}, {}, {}) {}, and the surface goes around it {}", x, y, z,
                                          lives ? "lives" : "is empty",
                                          around == 0   ? std::string("not at all")
                                          : around == 1 ? std::string("once")
                                                        : fmt::format("{} times", around));
        }
      }
      if (i > 0 && lives != (nodes.living[at(node - 1)] != 0)) {
        for (const auto& [shell, turns] : since) {
          if (turns == 0) continue;
          sides.between.push_back({shell, lives ? node : node - 1, lives ? node - 1 : node});
          if (turns != (lives ? 1 : -1)) turned[at(shell)] = 1;
        }
      }
      since.clear();
    }
    next = end;
  }
  sides.inside_out = std::count(turned.begin(), turned.end(), 1);
  return sides;
}

// Shells that lie between several components and regions of emptiness, of this topology.
int64_t count_joining(const Sides& sides, Topology& topology) {
  std::unordered_map<int32_t, std::array<std::size_t, 2>> lies_between;
  std::set<int32_t> joining;
  for (const Between& each : sides.between) {
    const std::array between = {topology.component.of(at(each.living)), topology.empty.of(at(each.empty))};
    if (lies_between.try_emplace(each.shell, between).first->second != between) joining.insert(each.shell);
  }
  return static_cast<int64_t>(joining.size());
}

// Each component of the tissue has one shell around it, and each of its cavities one: so each living node lies within
// the surface, each empty one outside, and no shell lies between two of either.
void check_shells(const Surface& surface, const Occupancy& nodes, Precision precision, Verdict& verdict) {
  Topology own(nodes, false);
  const Sides sides = sides_of(surface, nodes, precision);
  const int64_t joining = count_joining(sides, own);
  verdict.checked = own.outer + own.inner;
  verdict.inconclusive = sides.inconclusive;
  verdict.measured = static_cast<double>(std::abs(sides.outer - own.outer) + std::abs(sides.inner - own.inner) +
                                         joining + sides.inside_out + sides.wrong);
  if (verdict.measured == 0) return;
  verdict.holds = false;
  std::string text = fmt::format("{} outer and {} inner shells around {} components with {} cavities", sides.outer,
                                 sides.inner, own.outer, own.inner);
  if (joining > 0) text += fmt::format("; {} shells go around several components", joining);
  Topology other(nodes, true);
  if (sides.outer == other.outer && sides.inner == other.inner && count_joining(sides, other) == 0 &&
      sides.inside_out == 0 && sides.wrong == 0) {
    text += fmt::format(
        ". It is right in the other polarity ({} components, {} cavities): it joins living nodes that meet only across "
        "the diagonal of a face, where no edge joins the tissue; take the cases with inside and outside exchanged",
        other.outer, other.inner);
  } else if (sides.inside_out > 0) {
    text +=
        fmt::format(". {} shells are inside out: triangles are to be counter-clockwise seen from outside the tissue",
                    sides.inside_out);
  } else if (sides.wrong > 0) {
    text += fmt::format("; {}, and so of {} nodes", sides.first_wrong, sides.wrong);
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
          places = begin("surface places", "tolerances.md, A surface with free places"),
          closed = begin("surface", "method.md §8: closed, oriented, 2-manifold"),
          shells = begin("surface shells", "method.md §8, lemma");
  Surface surface;
  const Array &points = answers[0], &corners = answers[1];
  const double h = nodes.grid.spacing;
  for (int64_t v = 0; v < points.rows(); ++v) {
    surface.vertices.push_back({points.number(3 * v) / h, points.number(3 * v + 1) / h, points.number(3 * v + 2) / h});
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
  check_places(surface, nodes, precision, places);
  check_surface(surface, closed);
  if (!places.holds || !closed.holds) {
    shells.vacuous = "only a surface around the tissue has shells";
  } else {
    check_shells(surface, nodes, precision, shells);
  }
  for (Verdict* const verdict : {&vertices, &places, &closed, &shells}) {
    if (verdict->checked == 0 && verdict->holds && verdict->vacuous.empty()) verdict->vacuous = "nothing is alive";
  }
  return {vertices, places, closed, shells};
}

constexpr AnswerArray kSurfaceAnswers[] = {
    {.name = "vertices",
     .real = true,
     .columns = 3,
     .text = "places [m]: the living node plus a part of an edge, unless places are free"},
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
    .large_kinds = large_grid_kinds,
    .sizes = kSurfaceSizes,
    .draw_large = draw_large_surface,
};

}  // namespace cutproof::guests
