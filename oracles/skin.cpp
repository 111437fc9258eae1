// The skin (method.md §8): a closed surface by its half-edges, and vertices where the clusters of their owners put
// them.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <span>

#include "oracles/checks.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {
namespace {

struct Defect {
  std::string text;
  std::vector<int32_t> vertices;
};

// Outgoing half-edges of each vertex: triangle (v, to, after) leaves v towards `to`.
struct HalfEdge {
  int32_t to = 0, after = 0, triangle = 0;
};
struct HalfEdges {
  std::vector<int64_t> offsets;
  std::vector<HalfEdge> edges;
  std::span<const HalfEdge> of(int32_t v) const {
    const auto i = static_cast<std::size_t>(v);
    return {edges.data() + offsets[i], static_cast<std::size_t>(offsets[i + 1] - offsets[i])};
  }
  // The first half-edge from a to b, and the next one if a surface has more than it may; null: there is none.
  const HalfEdge* between(int32_t a, int32_t b, const HalfEdge* after = nullptr) const {
    const auto leaving = of(a);
    const HalfEdge* const end = leaving.data() + leaving.size();
    for (const HalfEdge* e = after == nullptr ? leaving.data() : after + 1; e != end; ++e) {
      if (e->to == b) return e;
    }
    return nullptr;
  }
};

HalfEdges half_edges_of(const Skin& skin) {
  HalfEdges result;
  result.offsets.assign(skin.owner.size() + 1, 0);
  for (const auto& t : skin.triangles) {
    for (const int32_t v : t) ++result.offsets[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < result.offsets.size(); ++v) result.offsets[v] += result.offsets[v - 1];
  result.edges.resize(3 * skin.triangles.size());
  std::vector<int64_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    const auto triangle = static_cast<int32_t>(t);
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(a)]++)] = {b, c, triangle};
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(b)]++)] = {c, a, triangle};
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(c)]++)] = {a, b, triangle};
  }
  return result;
}

// Three different vertices per triangle.
std::optional<Defect> triangle_defect(const Skin& skin) {
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    if (a == b || b == c || c == a) {
      return Defect{fmt::format("triangle {} names a vertex twice: {}, {}, {}", t, a, b, c), {a, b, c}};
    }
  }
  return std::nullopt;
}

// Each grid edge carries at most one vertex.
std::optional<Defect> duplicate_defect(const Skin& skin, int32_t particle_count) {
  std::vector<int32_t> vertex_at(6 * static_cast<std::size_t>(particle_count), -1);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    int32_t& slot = vertex_at[6 * static_cast<std::size_t>(skin.owner[v]) + skin.direction[v]];
    if (slot >= 0) {
      return Defect{fmt::format("vertices {} and {} lie on the same grid edge: from particle {} in direction {}", slot,
                                v, skin.owner[v], skin.direction[v]),
                    {slot, static_cast<int32_t>(v)}};
    }
    slot = static_cast<int32_t>(v);
  }
  return std::nullopt;
}

// Closed and oriented: each half-edge is there once, and its opposite once.
std::optional<Defect> edge_defect(const Skin& skin, const HalfEdges& half_edges) {
  for (int32_t a = 0; a < static_cast<int32_t>(skin.owner.size()); ++a) {
    for (const HalfEdge& e : half_edges.of(a)) {
      const HalfEdge* const first = half_edges.between(a, e.to);
      if (const HalfEdge* const second = half_edges.between(a, e.to, first)) {
        return Defect{
            fmt::format("triangles {} and {} both run from vertex {} to vertex {}: one is flipped, doubled, or "
                        "the edge has more than two triangles",
                        first->triangle, second->triangle, a, e.to),
            {a, e.to}};
      }
      if (half_edges.between(e.to, a) == nullptr) {
        return Defect{
            fmt::format("the surface is open: triangle {} runs from vertex {} to vertex {}, and none runs back",
                        e.triangle, a, e.to),
            {a, e.to}};
      }
    }
  }
  return std::nullopt;
}

// Manifold: the triangles around each vertex are one cycle. Requires the surface to be closed and oriented.
std::optional<Defect> fan_defect(const Skin& skin, const HalfEdges& half_edges) {
  for (int32_t v = 0; v < static_cast<int32_t>(skin.owner.size()); ++v) {
    const auto fan = half_edges.of(v);
    if (fan.empty()) return Defect{fmt::format("no triangle uses vertex {}", v), {v}};
    std::size_t length = 0;
    const HalfEdge* at = &fan[0];
    do {
      ++length;
      at = half_edges.between(v, at->after);
    } while (at->triangle != fan[0].triangle && length <= fan.size());
    if (length != fan.size()) {
      return Defect{fmt::format("the surface is pinched at vertex {}: {} triangles meet there, but only {} of them lie "
                                "in one cycle",
                                v, fan.size(), length),
                    {v}};
    }
  }
  return std::nullopt;
}

std::optional<Defect> surface_defect(const Skin& skin, int32_t particle_count) {
  if (auto defect = triangle_defect(skin)) return defect;
  if (auto defect = duplicate_defect(skin, particle_count)) return defect;
  const HalfEdges half_edges = half_edges_of(skin);
  if (auto defect = edge_defect(skin, half_edges)) return defect;
  return fan_defect(skin, half_edges);
}

void witness_vertices(Verdict& verdict, const Skin& skin, const std::vector<int32_t>& vertices) {
  std::set<int32_t> owners;
  for (const int32_t v : vertices) owners.insert(skin.owner[static_cast<std::size_t>(v)]);
  verdict.witness.particles.assign(owners.begin(), owners.end());
}

}  // namespace

bool skin_is_missing(const Setup& setup, const State& state) {
  const bool any_alive = std::find(state.alive.begin(), state.alive.end(), 1) != state.alive.end();
  return skin_is_due(setup, state) && any_alive && !has_skin(state);
}

void check_skin_surface(Judged& judged, Verdict& verdict) {
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  if (skin_is_missing(setup, state)) {
    verdict.holds = false;
    verdict.measured = 1;
    verdict.witness.text = "tissue is alive, and there is no skin";
    return;
  }
  if (const auto defect = surface_defect(skin, setup.body.particle_count())) {
    verdict.holds = false;
    verdict.measured = 1;
    verdict.witness.text = defect->text;
    witness_vertices(verdict, skin, defect->vertices);
  }
}

void check_skin_vertices(Judged& judged, Verdict& verdict) {
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.owner.size());
  if (!has_skin(state) && !skin_is_missing(setup, state)) return;
  const Body& body = setup.body;
  const auto fail = [&](const std::string& text, std::vector<int32_t> particles) {
    verdict.holds = false;
    verdict.witness.text = text;
    verdict.witness.particles = std::move(particles);
  };

  // The vertices are those of the grid edges with one alive end, each once.
  const auto is_alive = [&](int32_t i) { return i >= 0 && state.alive[static_cast<std::size_t>(i)] != 0; };
  std::vector<uint8_t> vertices_on(6 * static_cast<std::size_t>(body.particle_count()), 0);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const int direction = skin.direction[v];
    if (!is_alive(owner))
      return fail(fmt::format("vertex {} is owned by particle {}, which is dead", v, owner), {owner});
    const int32_t other = body.neighbour(owner, direction);
    if (is_alive(other)) {
      return fail(fmt::format("vertex {} lies on the edge from particle {} to particle {}, and both are alive", v,
                              owner, other),
                  {owner, other});
    }
    if (vertices_on[6 * static_cast<std::size_t>(owner) + static_cast<std::size_t>(direction)]++) {
      return fail(fmt::format("the edge from particle {} in direction {} carries two vertices", owner, direction),
                  {owner});
    }
  }
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (int d = 0; d < 6 && is_alive(i); ++d) {
      if (is_alive(body.neighbour(i, d)) ||
          vertices_on[6 * static_cast<std::size_t>(i) + static_cast<std::size_t>(d)]) {
        continue;
      }
      return fail(
          fmt::format("the edge from particle {} in direction {} leaves the tissue and carries no vertex", i, d), {i});
    }
  }

  // Their places.
  const Clusters& clusters = state.clusters;
  const WeightedRest weighted = weighted_rest(body, membership_counts(clusters, body.particle_count()));
  const Memberships& memberships_of_all = judged.memberships();
  std::vector<ClusterMeans> means;
  means.reserve(static_cast<std::size_t>(clusters.count()));
  for (int32_t c = 0; c < clusters.count(); ++c) means.push_back(cluster_means(weighted, clusters, state.x, c));
  const double h = body.grid.spacing;
  const double bound = 2 * goal_rounding(rounding_scale(setup, state)) / h;
  verdict.bound = bound;
  std::size_t worst = 0;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const auto memberships = memberships_of_all.of(owner);
    if (memberships.empty())
      return fail(fmt::format("particle {} owns vertex {} and lies in no cluster", owner, v), {owner});
    const auto& step = kDirections[skin.direction[v]];
    const Vec3 rest =
        body.rest_position(owner) + setup.skin.alpha * h * Vec3{1.0 * step[0], 1.0 * step[1], 1.0 * step[2]};
    Vec3 sum;
    for (const int32_t c : memberships) {
      const ClusterMeans& m = means[static_cast<std::size_t>(c)];
      sum += m.current + clusters.rotation[static_cast<std::size_t>(c)] * (rest - m.rest);
    }
    const double distance = norm(skin.position[v] - sum / static_cast<double>(memberships.size())) / h;
    if (!(distance <= verdict.measured)) {  // also if it is not a number
      verdict.measured = distance;
      worst = v;
      if (!std::isfinite(distance)) break;
    }
  }
  if (!(verdict.measured <= bound)) {
    const int32_t owner = skin.owner[worst];
    return fail(fmt::format("vertex {} of particle {} is {} h from where the particle's clusters put it", worst, owner,
                            verdict.measured),
                {owner});
  }
}

}  // namespace cutproof::oracles
