// The skin (method.md §8): a closed surface by its half-edges, and vertices where the clusters of their owners put
// them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "oracles/checks.h"
#include "oracles/open_edges.h"
#include "oracles/rounding.h"
#include "oracles/shells.h"

namespace cutproof::oracles {
namespace {

// Outgoing half-edges of each vertex: triangle (v, to, after) leaves v towards `to`.
struct HalfEdge {
  int32_t to = 0, after = 0, triangle = 0;
};
using HalfEdges = Rows<HalfEdge>;

HalfEdges half_edges_of(const Skin& skin) {
  std::vector<std::pair<int32_t, HalfEdge>> edges;
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    const auto triangle = static_cast<int32_t>(t);
    edges.insert(edges.end(), {{a, {b, c, triangle}}, {b, {c, a, triangle}}, {c, {a, b, triangle}}});
  }
  return {static_cast<int32_t>(skin.position.size()), edges};
}

// The first half-edge from a to b, and the next one if a surface has more than it may; null: there is none.
const HalfEdge* between(const HalfEdges& edges, int32_t a, int32_t b, const HalfEdge* last = nullptr) {
  const auto leaving = edges.of(a);
  const HalfEdge* const end = leaving.data() + leaving.size();
  for (const HalfEdge* e = last == nullptr ? leaving.data() : last + 1; e != end; ++e) {
    if (e->to == b) return e;
  }
  return nullptr;
}

// Each of these checks tells of the first defect that it finds, which concerns the owners of some vertices.

// Three different vertices per triangle.
void check_triangles(const Skin& skin, Verdict& verdict) {
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    if (a != b && b != c && c != a) continue;
    return violate(verdict, owners_of(skin, {a, b, c}, {static_cast<int32_t>(t)}),
                   "triangle {} names a vertex twice: {}, {}, {}", t, a, b, c);
  }
}

// Closed and oriented: each half-edge is there once, and its opposite once.
void check_edges(const Skin& skin, const HalfEdges& half_edges, Verdict& verdict) {
  for (int32_t a = 0; a < static_cast<int32_t>(skin.position.size()); ++a) {
    for (const HalfEdge& e : half_edges.of(a)) {
      const HalfEdge* const first = between(half_edges, a, e.to);
      if (const HalfEdge* const second = between(half_edges, a, e.to, first)) {
        return violate(verdict, owners_of(skin, {a, e.to}, {first->triangle, second->triangle}),
                       "triangles {} and {} both run from vertex {} to vertex {}: one is flipped, doubled, or the edge "
                       "has more than two triangles",
                       first->triangle, second->triangle, a, e.to);
      }
      if (between(half_edges, e.to, a) == nullptr) {
        return violate(verdict, owners_of(skin, {a, e.to}, {e.triangle}),
                       "the surface is open: triangle {} runs from vertex {} to vertex {}, and none runs back",
                       e.triangle, a, e.to);
      }
    }
  }
}

// Manifold: the triangles around each vertex are one cycle. Requires the surface to be closed and oriented.
void check_fans(const Skin& skin, const HalfEdges& half_edges, Verdict& verdict) {
  for (int32_t v = 0; v < static_cast<int32_t>(skin.position.size()); ++v) {
    const auto fan = half_edges.of(v);
    if (fan.empty()) return violate(verdict, owners_of(skin, {v}), "no triangle uses vertex {}", v);
    std::size_t length = 0;
    const HalfEdge* here = &fan[0];
    do {
      ++length;
      here = between(half_edges, v, here->after);
    } while (here->triangle != fan[0].triangle && length <= fan.size());
    if (length == fan.size()) continue;
    return violate(verdict, owners_of(skin, {v}, triangles_at(skin, {v})),
                   "the surface is pinched at vertex {}: {} triangles meet there, but only {} of them lie in one cycle",
                   v, fan.size(), length);
  }
}

// Both of the above, in the order in which they make sense.
void check_closed(const Skin& skin, Verdict& verdict) {
  const HalfEdges half_edges = half_edges_of(skin);
  check_edges(skin, half_edges, verdict);
  if (verdict.holds) check_fans(skin, half_edges, verdict);
}

}  // namespace

Concerned owners_of(const Skin& skin, const std::vector<int32_t>& vertices, std::vector<int32_t> triangles) {
  std::set<int32_t> owners;
  if (!skin.owner.empty()) {
    for (const int32_t v : vertices) owners.insert(skin.owner[at(v)]);
  }
  return {{}, {owners.begin(), owners.end()}, {}, std::move(triangles)};
}

std::vector<int32_t> triangles_at(const Skin& skin, const std::vector<int32_t>& vertices) {
  std::vector<int32_t> found;
  for (std::size_t t = 0; t < skin.triangles.size() && std::ssize(found) < kMostWitnessTriangles; ++t) {
    const auto& corners = skin.triangles[t];
    if (std::find_first_of(corners.begin(), corners.end(), vertices.begin(), vertices.end()) != corners.end())
      found.push_back(static_cast<int32_t>(t));
  }
  return found;
}

bool skin_is_missing(const Setup& setup, const State& state) {
  const bool any_alive = std::find(state.alive.begin(), state.alive.end(), 1) != state.alive.end();
  return skin_is_due(setup, state) && any_alive && !has_skin(state);
}

void check_skin_surface(Judged& judged, Verdict& verdict) {
  const Skin& skin = judged.state.skin;
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  if (skin_is_missing(judged.setup, judged.state)) {
    return violate(verdict, {}, "tissue is alive, and there is no skin");
  }
  check_triangles(skin, verdict);
  if (verdict.holds) check_closed(skin, verdict);
}

Verdict closed_surface(const Skin& skin) {
  const Property& property = property_named(core_properties(), "skin surface");
  Verdict verdict = start_verdict(property.name, {}, property.unit, property.source);
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  const auto vertices = static_cast<int32_t>(skin.position.size());
  for (int32_t v = 0; v < vertices; ++v) {
    if (!is_finite(skin.position[at(v)])) violate(verdict, {}, "the position of skin vertex {} is not finite", v);
  }
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    for (const int32_t v : skin.triangles[t]) {
      if (v < 0 || v >= vertices) violate(verdict, {}, "skin triangle {} names vertex {} of {}", t, v, vertices);
    }
  }
  if (verdict.holds) check_triangles(skin, verdict);
  if (verdict.holds) check_closed(skin, verdict);
  return conclude(std::move(verdict), property.nothing);
}

void check_skin_vertices(Judged& judged, Verdict& verdict) {
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.owner.size());
  if (!has_skin(state) && !skin_is_missing(setup, state)) return;
  const Body& body = setup.body;
  const auto around = [&](std::size_t v) { return triangles_at(skin, {static_cast<int32_t>(v)}); };
  // The vertices are those of the grid edges with one alive end, each once.
  const auto is_alive = [&](int32_t i) { return i >= 0 && state.alive[at(i)] != 0; };
  std::vector<uint8_t> vertices_on(6 * static_cast<std::size_t>(body.particle_count()), 0);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const int direction = skin.direction[v];
    if (!is_alive(owner))
      return fail(verdict, {{}, {owner}, {}, around(v)}, "vertex {} is owned by particle {}, which is dead", v, owner);
    const int32_t other = body.neighbour(owner, direction);
    if (is_alive(other)) {
      return fail(verdict, {{}, {owner, other}, {}, around(v)},
                  "vertex {} lies on the edge from particle {} to particle {}, and both are alive", v, owner, other);
    }
    if (vertices_on[6 * at(owner) + at(direction)]++) {
      return fail(verdict, {{}, {owner}, {}, around(v)},
                  "the edge from particle {} in direction {} carries two vertices", owner, direction);
    }
  }
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (int d = 0; d < 6 && is_alive(i); ++d) {
      if (is_alive(body.neighbour(i, d)) || vertices_on[6 * at(i) + at(d)]) continue;
      return fail(verdict, {{}, {i}},
                  "the edge from particle {} in direction {} leaves the tissue and carries no vertex", i, d);
    }
  }

  // Their places.
  const Memberships& memberships = judged.memberships();
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    if (memberships.of(owner).empty())
      return fail(verdict, {{}, {owner}, {}, around(v)}, "particle {} owns vertex {} and lies in no cluster", owner, v);
  }
  // Places of vertices along their edges that the state alone determines; vertices of a cut only have to lie on their
  // edges.
  const double u = unit_roundoff(state);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const bool opened = body.neighbour(skin.owner[v], skin.direction[v]) >= 0;
    if (opened && setup.skin.fit_cuts) continue;
    const double expected = uncut_reach(setup, skin.owner[v], skin.direction[v]);
    verdict.measured = std::abs(skin.reach[v] - expected);
    verdict.bound = u * expected;
    if (verdict.measured <= verdict.bound) continue;
    return fail(verdict, {{}, {skin.owner[v]}, {}, around(v)},
                "vertex {} lies {} h from particle {} in direction {}, where it should lie {} h from it", v,
                figure_beside(skin.reach[v], expected), skin.owner[v], skin.direction[v],
                figure_beside(expected, skin.reach[v]));
  }
  const double h = body.grid.spacing;
  Nearest nearest;
  const std::vector<VertexPlace> places = vertex_places(setup, state, skin, memberships);
  for (std::size_t v = 0; v < places.size(); ++v) {
    nearest.see(norm(skin.position[v] - places[v].place) / h, places[v].bound / h, static_cast<int32_t>(v));
  }
  if (nearest.where < 0) return;
  verdict.measured = nearest.measured;
  verdict.bound = nearest.bound;
  if (nearest.holds()) return;
  const int32_t owner = skin.owner[at(nearest.where)];
  fail(verdict, {{}, {owner}, {}, around(at(nearest.where))},
       "vertex {} of particle {} is {} h from where the particle's clusters put it", nearest.where, owner,
       verdict.measured);
}

namespace {

struct Range {
  double low = 0, high = 0;
  bool contains(double value) const { return low <= value && value <= high; }
};

// Where a vertex lies on an edge that a plane crosses at t, from the owner on, in parts of the edge: by these points,
// linearly between them, alpha before and behind.
class ReachByBlade {
 public:
  explicit ReachByBlade(double alpha)
      : points_{
            {{-1, alpha}, {0, 1.0 / 16}, {1.0 / 16, 1.0 / 16}, {15.0 / 16, 15.0 / 16}, {2, 15.0 / 16}, {3, alpha}}} {}

  double at_crossing(double t) const {
    if (!(t > points_.front()[0])) return points_.front()[1];
    for (std::size_t k = 1; k < points_.size(); ++k) {
      const auto& [begin, from] = points_[k - 1];
      const auto& [end, to] = points_[k];
      if (t <= end) return from + (to - from) * (t - begin) / (end - begin);
    }
    return points_.back()[1];
  }
  Range over(Range t) const {
    Range found = {at_crossing(t.low), at_crossing(t.low)};
    const auto see = [&](double reach) { found = {std::min(found.low, reach), std::max(found.high, reach)}; };
    see(at_crossing(t.high));
    for (const auto& [crossing, reach] : points_) {
      if (t.contains(crossing)) see(reach);
    }
    return found;
  }
  // The flatter an edge lies to the plane, the less the crossing counts; `apart`: how much farther from the plane one
  // end of it is than the other [h].
  double of(double crossing, double apart) const {
    const double counts = std::min(1.0, 4 * std::abs(apart)), alpha = points_.front()[1];
    return counts * crossing + (1 - counts) * alpha;
  }
  Range anywhere() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return over({-kInfinity, kInfinity});
  }

 private:
  std::array<std::array<double, 2>, 6> points_;
};

// Of the two ends of grid edges how far from a plane the owners' clusters carry them, and by how much that may be off
// [m].
struct Heights {
  std::vector<double> owner, end, owner_bound, end_bound;
};
Heights heights_of(const Setup& setup, const State& state, const std::vector<std::size_t>& vertices,
                   const BladePose& plane, const Memberships& memberships) {
  const Vec3 normal = cross(plane.along, plane.back);
  Heights heights;
  for (const double reach : {0.0, 1.0}) {  // one end of each edge, then the other
    Skin ends;
    for (const std::size_t v : vertices) {
      ends.owner.push_back(state.skin.owner[v]);
      ends.direction.push_back(state.skin.direction[v]);
      ends.reach.push_back(reach);
    }
    for (const auto& [place, bound] : vertex_places(setup, state, ends, memberships)) {
      (reach == 0 ? heights.owner : heights.end).push_back(dot(place - plane.edge, normal));
      (reach == 0 ? heights.owner_bound : heights.end_bound)
          .push_back(bound + kPlacesBand * unit_roundoff(state) * (norm(place) + norm(plane.edge)));
    }
  }
  return heights;
}

// Where rounding leaves the crossing of a plane: t = owner / (owner - end) is monotone in both heights where the two
// cannot be equal, so its least and its greatest value lie at corners.
std::optional<Range> crossings(double owner, double owner_bound, double end, double end_bound) {
  const double apart = owner - end, apart_bound = owner_bound + end_bound;
  if (!(std::abs(apart) > apart_bound)) return std::nullopt;
  Range found = {owner / apart, owner / apart};
  for (const double a : {owner - owner_bound, owner + owner_bound}) {
    for (const double b : {end - end_bound, end + end_bound}) {
      found = {std::min(found.low, a / (a - b)), std::max(found.high, a / (a - b))};
    }
  }
  return found;
}

}  // namespace

// Vertices that were there before stay where they are on their edges. Beside what has died in this frame they lie where
// the blade's plane crosses their edges, if cuts are fitted; all others where the body says, or alpha.
void check_skin_reach(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  const Skin& skin = after.skin;
  verdict.checked = static_cast<int64_t>(skin.owner.size());
  std::map<std::pair<int32_t, uint8_t>, double> known;
  for (std::size_t v = 0; v < before.skin.owner.size(); ++v) {
    known[{before.skin.owner[v], before.skin.direction[v]}] = before.skin.reach[v];
  }
  const std::set<int32_t> died = [&] {
    std::set<int32_t> all(before.removed.begin(), before.removed.end());
    all.insert(before.debris.begin(), before.debris.end());
    return all;
  }();
  const BladePose* const blade = setup.skin.fit_cuts ? last_lowered(setup, before.frame) : nullptr;
  const double u = unit_roundoff(after);
  Nearest nearest;
  std::vector<std::size_t> by_blade;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v], end = setup.body.neighbour(owner, skin.direction[v]);
    const auto found = known.find({owner, skin.direction[v]});
    if (found == known.end() && blade != nullptr && died.count(end) > 0) {
      by_blade.push_back(v);
      continue;
    }
    const double expected = found != known.end() ? found->second : uncut_reach(setup, owner, skin.direction[v]);
    nearest.see(std::abs(skin.reach[v] - expected), u * expected, static_cast<int32_t>(v));
  }
  const Memberships memberships = memberships_of(after.clusters, setup.body.particle_count());
  std::erase_if(by_blade, [&](std::size_t v) { return memberships.of(skin.owner[v]).empty(); });  // "coverage" says so
  if (!by_blade.empty()) {
    const Heights heights = heights_of(setup, after, by_blade, *blade, memberships);
    const ReachByBlade reach_by_blade(setup.skin.alpha);
    const double h = setup.body.grid.spacing;
    for (std::size_t k = 0; k < by_blade.size(); ++k) {
      const double owner = heights.owner[k], end = heights.end[k];
      const double apart_bound = heights.owner_bound[k] + heights.end_bound[k];
      const auto t = crossings(owner, heights.owner_bound[k], end, heights.end_bound[k]);
      const Range crossing = t ? reach_by_blade.over(*t) : reach_by_blade.anywhere();
      const double expected = reach_by_blade.of(reach_by_blade.at_crossing(owner / (owner - end)), (owner - end) / h);
      // What the arithmetic adds: a quotient, a product and two sums of numbers up to 1.
      double bound = 4 * u;
      for (const double there : {crossing.low, crossing.high}) {
        for (const double apart : {std::abs(owner - end) + apart_bound, std::abs(owner - end) - apart_bound}) {
          const double other = reach_by_blade.of(there, std::max(0.0, apart) / h);
          bound = std::max(bound, std::abs(other - expected) + 4 * u);
        }
      }
      nearest.see(std::abs(skin.reach[by_blade[k]] - expected), bound, static_cast<int32_t>(by_blade[k]));
    }
  }
  if (nearest.where < 0) return;
  verdict.measured = nearest.measured;
  verdict.bound = nearest.bound;
  if (nearest.holds()) return;
  const std::size_t v = at(nearest.where);
  fail(verdict, {{}, {skin.owner[v]}, {}, triangles_at(skin, {nearest.where})},
       "vertex {} lies {} h from particle {} in direction {}, which is {} h from where it should lie", v, skin.reach[v],
       skin.owner[v], skin.direction[v], verdict.measured);
}

}  // namespace cutproof::oracles
