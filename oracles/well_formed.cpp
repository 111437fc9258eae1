// Whether a state can be read safely: sizes, offsets, indices. Every other check relies on it.
#include <fmt/format.h>

#include <algorithm>

#include "model/bare_graph.h"
#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

void check_bare_graph_form(const Body& body, Verdict& verdict) {
  if (!body.node.empty() || !body.particle_at.empty()) {
    return violate(verdict, {}, "the body has both nodes of a grid and edges of its own");
  }
  if (body.mass.size() != body.rest.size()) {
    return violate(verdict, {}, "the body has {} masses for {} particles", body.mass.size(), body.rest.size());
  }
  if (!body.surface_crossing.empty()) {
    return violate(verdict, {}, "a body without a grid has crossings of its surface with grid edges");
  }
  const std::string problem = problem_of_edges(body);
  if (!problem.empty()) violate(verdict, {}, "{}", problem);
}

void check_grid_form(const Body& body, Verdict& verdict) {
  const Grid& grid = body.grid;
  if (grid.nodes[0] < 0 || grid.nodes[1] < 0 || grid.nodes[2] < 0)
    return violate(verdict, {}, "the grid has a negative side");
  if (static_cast<int64_t>(body.particle_at.size()) != grid.node_count()) {
    return violate(verdict, {}, "particle_at has {} entries for {} grid nodes", body.particle_at.size(),
                   grid.node_count());
  }
  if (body.mass.size() != body.node.size()) {
    return violate(verdict, {}, "the body has {} masses for {} particles", body.mass.size(), body.node.size());
  }
  const int32_t n = body.particle_count();
  if (!body.surface_crossing.empty() && body.surface_crossing.size() != 6 * at(n)) {
    return violate(verdict, {}, "the body has {} crossings of its surface for {} particles",
                   body.surface_crossing.size(), n);
  }
  for (int32_t i = 0; i < n; ++i) {
    const int64_t node = body.node[at(i)];
    if (node < 0 || node >= grid.node_count()) return violate(verdict, {{}, {i}}, "particle {} is on no node", i);
    if (i > 0 && node <= body.node[at(i - 1)])
      return violate(verdict, {{}, {i}}, "nodes do not ascend at particle {}", i);
    const auto c = grid.coordinates(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (c[axis] < 1 || c[axis] > grid.nodes[axis] - 2) {
        return violate(verdict, {{}, {i}}, "particle {} lies on the outer ring of nodes", i);
      }
    }
    if (body.particle_at[at(node)] != i) return violate(verdict, {{}, {i}}, "particle_at does not know particle {}", i);
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = body.neighbour(i, direction);
      if (other < -1 || other >= n) {
        return violate(verdict, {{}, {i}}, "particle_at names a particle {} that does not exist", other);
      }
      const double crossing = body.crossing(i, direction) * kCrossingSteps;
      if (crossing != 0 && (other >= 0 || crossing < kLeastCrossing || crossing > kGreatestCrossing)) {
        return violate(verdict, {{}, {i}}, "the surface crosses the edge of particle {} in direction {} at {}/{}{}", i,
                       direction, crossing, kCrossingSteps, other >= 0 ? ", and it leads to another particle" : "");
      }
    }
  }
}

// Where the body itself cannot be read safely, the rest is not looked at.
void check_body_form(const Setup& setup, Verdict& verdict) {
  const Body& body = setup.body;
  body.on_grid() ? check_grid_form(body, verdict) : check_bare_graph_form(body, verdict);
  if (!verdict.holds) return;
  if (!(body.grid.spacing > 0)) return violate(verdict, {}, "the body's spacing is {}", body.grid.spacing);
  if (!body.on_grid() && setup.skin.wanted) return violate(verdict, {}, "a body without a grid has no skin");
  const int32_t n = body.particle_count();
  const auto substeps = static_cast<std::size_t>(setup.frame_count()) * at(std::max(setup.step.substeps, 0));
  if (setup.has_blade && setup.blade_moves.size() != substeps) {
    return violate(verdict, {}, "{} blade moves for {} substeps", setup.blade_moves.size(), substeps);
  }
  for (const Grip& grip : setup.grips) {
    if (grip.active.size() != substeps || grip.displacement.size() != substeps) {
      return violate(verdict, {}, "a grip's table has {} and {} entries for {} substeps", grip.active.size(),
                     grip.displacement.size(), substeps);
    }
    for (const int32_t i : grip.particles) {
      if (i < 0 || i >= n) return violate(verdict, {{}, {i}}, "a grip holds particle {}, which does not exist", i);
    }
  }
}

void check_particle_list(const std::vector<int32_t>& list, const char* name, int32_t n, Verdict& verdict) {
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (list[k] < 0 || list[k] >= n) {
      violate(verdict, {{}, {list[k]}}, "{} lists particle {} of {}", name, list[k], n);
    } else if (k > 0 && list[k] <= list[k - 1]) {
      violate(verdict, {{}, {list[k]}}, "{} does not ascend at particle {}", name, list[k]);
    }
  }
}

void check_clusters_form(const Clusters& clusters, bool members_exist, int32_t n, Verdict& verdict) {
  if (clusters.offsets.empty()) return violate(verdict, {}, "cluster offsets are empty");
  const std::size_t m = clusters.offsets.size() - 1;
  if (clusters.number.size() != m || clusters.rotation.size() != m || clusters.rest_center.size() != m ||
      clusters.mass.size() != m || clusters.degenerate.size() != m) {
    return violate(verdict, {}, "{} clusters, but {} numbers, {} rotations, {} rest centers, {} masses, {} flags", m,
                   clusters.number.size(), clusters.rotation.size(), clusters.rest_center.size(), clusters.mass.size(),
                   clusters.degenerate.size());
  }
  if (clusters.offsets.front() != 0) {
    return violate(verdict, {}, "the first cluster offset is {}, not 0", clusters.offsets.front());
  }
  if (clusters.offsets.back() != static_cast<int64_t>(clusters.members.size())) {
    return violate(verdict, {}, "the last cluster offset is {} for {} members", clusters.offsets.back(),
                   clusters.members.size());
  }
  for (std::size_t c = 0; c < m; ++c) {
    const int32_t number = clusters.number[c];
    if (clusters.offsets[c + 1] < clusters.offsets[c]) {
      violate(verdict, {{number}}, "cluster offsets decrease at cluster {}", number);
    }
    if (number < 0 || (c > 0 && number <= clusters.number[c - 1])) {
      violate(verdict, {{number}}, "cluster numbers do not ascend at {}", number);
    }
  }
  if (members_exist) return;
  for (const int32_t i : clusters.members) {
    if (i < 0 || i >= n) {
      violate(verdict, {{}, {i}}, "a cluster holds particle {}, but there are {}", i, n);
    }
  }
}

void check_skin_form(const Skin& skin, int32_t n, Verdict& verdict) {
  const std::size_t vertices = skin.owner.size();
  if (skin.direction.size() != vertices || skin.reach.size() != vertices || skin.position.size() != vertices) {
    violate(verdict, {}, "the skin has {} owners, {} directions, {} reaches, {} positions", vertices,
            skin.direction.size(), skin.reach.size(), skin.position.size());
    return;
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (skin.owner[v] < 0 || skin.owner[v] >= n || skin.direction[v] >= kDirections.size()) {
      violate(verdict, {{}, {skin.owner[v]}}, "skin vertex {} has owner {} and direction {}", v, skin.owner[v],
              skin.direction[v]);
    }
    if (!(skin.reach[v] > 0 && skin.reach[v] < 1)) {
      violate(verdict, {{}, {skin.owner[v]}}, "skin vertex {} lies {} h from its owner, and not on its edge", v,
              figure_beside(skin.reach[v], 1));
    }
  }
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    for (const int32_t v : skin.triangles[t]) {
      if (v < 0 || at(v) >= vertices) {
        violate(verdict, {}, "skin triangle {} names vertex {} of {}", t, v, vertices);
      }
    }
  }
}

}  // namespace

// `known`: parts that have the bits of a state of the same body that was well formed. Of those only the sizes that they
// share with others are looked at again.
Verdict check_form(const Setup& setup, const State& state, unsigned known) {
  Verdict verdict = start_verdict("well formed", state, "1", "model/state.h, model/clusters.h, model/skin.h");
  if (known == 0) check_body_form(setup, verdict);
  if (!verdict.holds) return verdict;
  const int32_t n = setup.body.particle_count();
  if (state.x.size() != at(n) || state.v.size() != at(n) || state.alive.size() != at(n)) {
    violate(verdict, {}, "{} particles, but {} positions, {} velocities, {} alive flags", n, state.x.size(),
            state.v.size(), state.alive.size());
  }
  for (std::size_t i = 0; (known & kAlive) == 0 && i < state.alive.size(); ++i) {
    if (state.alive[i] > 1) {
      violate(verdict, {{}, {static_cast<int32_t>(i)}}, "particle {} is neither alive nor dead", i);
    }
  }
  if ((known & kCut) == 0) {
    check_particle_list(state.removed, "removed", n, verdict);
    check_particle_list(state.debris, "debris", n, verdict);
  }
  check_clusters_form(state.clusters, (known & kSets) != 0, n, verdict);
  if ((known & kSkin) == 0) check_skin_form(state.skin, n, verdict);
  if (state.frame < 0) violate(verdict, {}, "the frame is {}", state.frame);
  verdict.checked = static_cast<int64_t>(n) + static_cast<int64_t>(state.clusters.offsets.size()) +
                    static_cast<int64_t>(state.clusters.members.size()) +
                    static_cast<int64_t>(state.skin.owner.size() + state.skin.triangles.size());
  return verdict;
}

}  // namespace cutproof::oracles
