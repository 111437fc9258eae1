// Oracles of one state: the invariants of method.md §2, and what else must hold between stages.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <span>

#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// Parts of a state, as bits of what an oracle reads.
enum Part : unsigned {
  kMotion = 1,      // x, v, impulse
  kAlive = 2,       // alive
  kCut = 4,         // removed, debris
  kSets = 8,        // offsets and members of clusters
  kFrames = 16,     // rest centers and masses
  kRotations = 32,  // rotations and degenerate flags
  kSkin = 64,
  kLimits = 128,  // tau, cap, edge_covered
  kAll = 255,
  kBody = 256  // the body, which does not change
};

template <typename T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

unsigned parts_that_differ(const State& a, const State& b) {
  const Clusters &c = a.clusters, &d = b.clusters;
  const Skin &s = a.skin, &t = b.skin;
  unsigned parts = 0;
  const auto note = [&](Part part, bool equal) { parts |= equal ? 0u : part; };
  note(kMotion, same(a.x, b.x) && same(a.v, b.v) && same_bits(a.impulse, b.impulse));
  note(kAlive, same(a.alive, b.alive));
  note(kCut, same(a.removed, b.removed) && same(a.debris, b.debris));
  note(kSets, same(c.offsets, d.offsets) && same(c.members, d.members));
  note(kFrames, same(c.rest_center, d.rest_center) && same(c.mass, d.mass));
  note(kRotations, same(c.rotation, d.rotation) && same(c.degenerate, d.degenerate));
  note(kSkin, same(s.owner, t.owner) && same(s.direction, t.direction) && same(s.position, t.position) &&
                  same(s.triangles, t.triangles));
  note(kLimits, a.tau == b.tau && a.cap == b.cap && a.edge_covered == b.edge_covered);
  return parts;
}

// A well-formed state with what several oracles derive from it, derived once.
class Judged {
 public:
  Judged(const Setup& of_setup, const State& of_state)
      : setup(of_setup),
        state(of_state),
        body(of_setup.body),
        clusters(of_state.clusters),
        graph(of_setup.body, of_state.alive) {}

  const Partition& components() {
    if (!components_) components_ = components_of_graph(graph);
    return *components_;
  }
  const Partition& coupling() {
    if (!coupling_) coupling_ = components_of_coupling(graph, clusters);
    return *coupling_;
  }
  // Takes over what was derived from another state of the same body and rests on none of the parts that `differ`.
  void take_over(Judged& last, unsigned differ) {
    if ((differ & kAlive) == 0) components_ = std::move(last.components_);
    if ((differ & (kAlive | kSets)) == 0) coupling_ = std::move(last.coupling_);
    connected = std::move(last.connected);
    if (connected.empty() || (differ & (kAlive | kSets)) == 0) return;
    // Whether a cluster is connected depends on its members, on which of them are alive, and on the grid. So it stays
    // known of each cluster whose members are those of the cluster that had its number, if none of them lives or is
    // dead that was not before.
    std::vector<uint8_t> known(at(clusters.count()), 0);
    for (int32_t c = 0, before = 0; c < clusters.count(); ++c) {
      while (before < last.clusters.count() && last.number(before) < number(c)) ++before;
      if (before == last.clusters.count()) break;
      if (last.number(before) != number(c) || connected[at(before)] == 0) continue;
      const auto now = clusters.of(c), then = last.clusters.of(before);
      known[at(c)] = std::equal(now.begin(), now.end(), then.begin(), then.end()) &&
                     std::all_of(now.begin(), now.end(), [&](int32_t i) { return alive(i) == last.alive(i); });
    }
    connected = std::move(known);
  }
  int32_t number(int32_t cluster) const { return clusters.number[at(cluster)]; }
  bool alive(int32_t particle) const { return state.alive[at(particle)] != 0; }
  bool has_skin() const { return !state.skin.owner.empty() || !state.skin.triangles.empty(); }

  const Setup& setup;
  const State& state;
  const Body& body;
  const Clusters& clusters;
  const TissueGraph graph;
  std::vector<uint8_t> connected;  // [m] 1: check_connectivity has found the cluster to be; empty: it knows of none

 private:
  std::optional<Partition> components_, coupling_;
};

// --- Well formed -----------------------------------------------------------------------------------------------------

// False if the body itself cannot be read safely; the rest is not looked at then.
bool body_is_well_formed(const Setup& setup, Verdict& verdict) {
  const Body& body = setup.body;
  const Grid& grid = body.grid;
  const auto reject = [&](std::string text, std::vector<int32_t> particles = {}) {
    violate(verdict, std::move(text), {}, std::move(particles));
    return false;
  };
  if (grid.nodes[0] < 0 || grid.nodes[1] < 0 || grid.nodes[2] < 0) return reject("the grid has a negative side");
  if (static_cast<int64_t>(body.particle_at.size()) != grid.node_count()) {
    return reject(
        fmt::format("particle_at has {} entries for {} grid nodes", body.particle_at.size(), grid.node_count()));
  }
  if (body.mass.size() != body.node.size()) {
    return reject(fmt::format("the body has {} masses for {} particles", body.mass.size(), body.node.size()));
  }
  if (!(grid.spacing > 0)) return reject(fmt::format("the grid's spacing is {}", grid.spacing));
  const int32_t n = body.particle_count();
  for (int32_t i = 0; i < n; ++i) {
    const int64_t node = body.node[at(i)];
    if (node < 0 || node >= grid.node_count()) return reject(fmt::format("particle {} is on no node", i), {i});
    if (i > 0 && node <= body.node[at(i - 1)]) return reject(fmt::format("nodes do not ascend at particle {}", i), {i});
    const auto c = grid.coordinates(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (c[axis] < 1 || c[axis] > grid.nodes[axis] - 2) {
        return reject(fmt::format("particle {} lies on the outer ring of nodes", i), {i});
      }
    }
    if (body.particle_at[at(node)] != i) return reject(fmt::format("particle_at does not know particle {}", i), {i});
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = body.neighbour(i, direction);
      if (other < -1 || other >= n) {
        return reject(fmt::format("particle_at names a particle {} that does not exist", other), {i});
      }
    }
  }
  const auto substeps = static_cast<std::size_t>(setup.frame_count()) * at(std::max(setup.step.substeps, 0));
  if (setup.has_blade && setup.blade_moves.size() != substeps) {
    return reject(fmt::format("{} blade moves for {} substeps", setup.blade_moves.size(), substeps));
  }
  for (const Grip& grip : setup.grips) {
    if (grip.active.size() != substeps || grip.displacement.size() != substeps) {
      return reject(fmt::format("a grip's table has {} and {} entries for {} substeps", grip.active.size(),
                                grip.displacement.size(), substeps));
    }
    for (const int32_t i : grip.particles) {
      if (i < 0 || i >= n) return reject(fmt::format("a grip holds particle {}, which does not exist", i), {i});
    }
  }
  return true;
}

void check_particle_list(const std::vector<int32_t>& list, const char* name, int32_t n, Verdict& verdict) {
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (list[k] < 0 || list[k] >= n) {
      violate(verdict, fmt::format("{} lists particle {} of {}", name, list[k], n), {}, {list[k]});
    } else if (k > 0 && list[k] <= list[k - 1]) {
      violate(verdict, fmt::format("{} does not ascend at particle {}", name, list[k]), {}, {list[k]});
    }
  }
}

void check_clusters_form(const Clusters& clusters, bool members_exist, int32_t n, Verdict& verdict) {
  const auto reject = [&](std::string text) { violate(verdict, std::move(text)); };
  if (clusters.offsets.empty()) return reject("cluster offsets are empty");
  const std::size_t m = clusters.offsets.size() - 1;
  if (clusters.number.size() != m || clusters.rotation.size() != m || clusters.rest_center.size() != m ||
      clusters.mass.size() != m || clusters.degenerate.size() != m) {
    return reject(fmt::format("{} clusters, but {} numbers, {} rotations, {} rest centers, {} masses, {} flags", m,
                              clusters.number.size(), clusters.rotation.size(), clusters.rest_center.size(),
                              clusters.mass.size(), clusters.degenerate.size()));
  }
  if (clusters.offsets.front() != 0) {
    return reject(fmt::format("the first cluster offset is {}, not 0", clusters.offsets.front()));
  }
  if (clusters.offsets.back() != static_cast<int64_t>(clusters.members.size())) {
    return reject(
        fmt::format("the last cluster offset is {} for {} members", clusters.offsets.back(), clusters.members.size()));
  }
  for (std::size_t c = 0; c < m; ++c) {
    const int32_t number = clusters.number[c];
    if (clusters.offsets[c + 1] < clusters.offsets[c]) {
      violate(verdict, fmt::format("cluster offsets decrease at cluster {}", number), {number});
    }
    if (number < 0 || (c > 0 && number <= clusters.number[c - 1])) {
      violate(verdict, fmt::format("cluster numbers do not ascend at {}", number), {number});
    }
  }
  if (members_exist) return;
  for (const int32_t i : clusters.members) {
    if (i < 0 || i >= n) {
      violate(verdict, fmt::format("a cluster holds particle {}, but there are {}", i, n), {}, {i});
    }
  }
}

void check_skin_form(const Skin& skin, int32_t n, Verdict& verdict) {
  const std::size_t vertices = skin.owner.size();
  if (skin.direction.size() != vertices || skin.position.size() != vertices) {
    violate(verdict, fmt::format("the skin has {} owners, {} directions, {} positions", vertices, skin.direction.size(),
                                 skin.position.size()));
    return;
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (skin.owner[v] < 0 || skin.owner[v] >= n || skin.direction[v] >= kDirections.size()) {
      violate(verdict, fmt::format("skin vertex {} has owner {} and direction {}", v, skin.owner[v], skin.direction[v]),
              {}, {skin.owner[v]});
    }
  }
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    for (const int32_t v : skin.triangles[t]) {
      if (v < 0 || at(v) >= vertices) {
        violate(verdict, fmt::format("skin triangle {} names vertex {} of {}", t, v, vertices));
      }
    }
  }
}

// `known`: parts that have the bits of a state of the same body that was well formed. Of those only the sizes that they
// share with others are looked at again.
Verdict check_form(const Setup& setup, const State& state, unsigned known = 0) {
  Verdict verdict = start_verdict("well formed", state, "1", "model/state.h, model/clusters.h, model/skin.h");
  const auto reject = [&](std::string text) { violate(verdict, std::move(text)); };
  if (known == 0 && !body_is_well_formed(setup, verdict)) return verdict;
  const int32_t n = setup.body.particle_count();
  if (state.x.size() != at(n) || state.v.size() != at(n) || state.alive.size() != at(n)) {
    reject(fmt::format("{} particles, but {} positions, {} velocities, {} alive flags", n, state.x.size(),
                       state.v.size(), state.alive.size()));
  }
  for (std::size_t i = 0; (known & kAlive) == 0 && i < state.alive.size(); ++i) {
    if (state.alive[i] > 1) {
      violate(verdict, fmt::format("particle {} is neither alive nor dead", i), {}, {static_cast<int32_t>(i)});
    }
  }
  if ((known & kCut) == 0) {
    check_particle_list(state.removed, "removed", n, verdict);
    check_particle_list(state.debris, "debris", n, verdict);
  }
  check_clusters_form(state.clusters, (known & kSets) != 0, n, verdict);
  if ((known & kSkin) == 0) check_skin_form(state.skin, n, verdict);
  if (state.frame < 0) reject(fmt::format("the frame is {}", state.frame));
  verdict.checked = static_cast<int64_t>(n) + static_cast<int64_t>(state.clusters.offsets.size()) +
                    static_cast<int64_t>(state.clusters.members.size()) +
                    static_cast<int64_t>(state.skin.owner.size() + state.skin.triangles.size());
  return verdict;
}

// --- I1, I2 ----------------------------------------------------------------------------------------------------------

// Dead members are coverage's business: here a cluster is what is alive of it.
Verdict check_connectivity(Judged& judged) {
  Verdict verdict = start_verdict("cluster connectivity", judged.state, "1", "method.md §2, I1");
  std::vector<int32_t> member_of(at(judged.body.particle_count()), -1);   // the last cluster seen to hold it
  std::vector<int32_t> reached_in(at(judged.body.particle_count()), -1);  // the last cluster it was reached in
  std::vector<int32_t> queue;
  judged.connected.resize(at(judged.clusters.count()), 0);
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    ++verdict.checked;
    if (judged.connected[at(c)] != 0) continue;
    int32_t seed = -1, size = 0;
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i) || member_of[at(i)] == c) continue;
      member_of[at(i)] = c;
      ++size;
      if (seed < 0) seed = i;
    }
    judged.connected[at(c)] = 1;
    if (seed < 0) continue;
    queue.assign(1, seed);
    reached_in[at(seed)] = c;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      for (int direction = 0; direction < 6; ++direction) {
        const int32_t other = judged.graph.neighbour(queue[head], direction);
        if (other < 0 || member_of[at(other)] != c || reached_in[at(other)] == c) continue;
        reached_in[at(other)] = c;
        queue.push_back(other);
      }
    }
    const auto reached = static_cast<int32_t>(queue.size());
    if (reached == size) continue;
    judged.connected[at(c)] = 0;
    Witness witness;
    if (verdict.holds) {
      for (const int32_t i : judged.clusters.of(c)) {
        if (!judged.alive(i) || reached_in[at(i)] == c) continue;
        witness = {{judged.number(c)},
                   {seed, i},
                   {},
                   fmt::format("cluster {} is not connected: {} of its {} particles are reached from particle {}, "
                               "particle {} is not",
                               judged.number(c), reached, size, seed, i)};
        break;
      }
    }
    violate(verdict, witness);
  }
  return verdict;
}

Verdict check_coverage(Judged& judged) {
  Verdict verdict = start_verdict("coverage", judged.state, "1", "method.md §2, I2");
  std::vector<uint8_t> covered(at(judged.body.particle_count()), 0);
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    const auto members = judged.clusters.of(c);
    const int32_t number = judged.number(c);
    if (members.empty()) violate(verdict, fmt::format("cluster {} has no particles", number), {number});
    for (std::size_t k = 0; k < members.size(); ++k) {
      const int32_t i = members[k];
      covered[at(i)] = 1;
      if (!judged.alive(i)) {
        violate(verdict, fmt::format("cluster {} holds particle {}, which is dead", number, i), {number}, {i});
      }
      if (k > 0 && members[k] == members[k - 1]) {
        violate(verdict, fmt::format("cluster {} holds particle {} twice", number, i), {number}, {i});
      } else if (k > 0 && members[k] < members[k - 1]) {
        violate(verdict, fmt::format("the members of cluster {} do not ascend", number), {number}, {members[k - 1], i});
      }
    }
  }
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i) && covered[at(i)] == 0) {
      violate(verdict, fmt::format("particle {} is alive and in no cluster", i), {}, {i});
    }
  }
  for (const auto* list : {&judged.state.removed, &judged.state.debris}) {
    for (const int32_t i : *list) {
      if (judged.alive(i)) violate(verdict, fmt::format("particle {} was removed but is alive", i), {}, {i});
    }
  }
  verdict.checked = judged.body.particle_count() + static_cast<int64_t>(judged.clusters.members.size());
  return verdict;
}

// --- I3 --------------------------------------------------------------------------------------------------------------

// How many different (a, b) occur among particles. Equal to a.count exactly if a refines b, and to b.count exactly if
// b refines a.
int64_t distinct_pairs(const Partition& a, const Partition& b) {
  // Particles in the order of their label in a, by counting.
  std::vector<int64_t> next(at(a.count) + 1, 0);
  for (const int32_t label : a.label) {
    if (label >= 0) ++next[at(label) + 1];
  }
  for (std::size_t k = 0; k < at(a.count); ++k) next[k + 1] += next[k];
  std::vector<int32_t> order(at(next.back()));
  for (std::size_t i = 0; i < a.label.size(); ++i) {
    if (a.label[i] >= 0) order[at(next[at(a.label[i])]++)] = static_cast<int32_t>(i);
  }
  std::vector<int32_t> seen_with(at(b.count), -1);
  int64_t pairs = 0;
  for (const int32_t i : order) {
    int32_t& seen = seen_with[at(b.label[at(i)])];
    if (seen == a.label[at(i)]) continue;
    seen = a.label[at(i)];
    ++pairs;
  }
  return pairs;
}

struct Edge {
  int32_t a = -1, b = -1;
};

// An edge of G whose ends are not coupled: if anything connected is not coupled there is one, and no shorter path
// shows it.
Edge first_uncoupled_edge(Judged& judged) {
  const std::vector<int32_t>& coupled = judged.coupling().label;
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (!judged.alive(i)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t other = judged.graph.neighbour(i, 2 * axis);
      if (other >= 0 && coupled[at(i)] != coupled[at(other)]) return {i, other};
    }
  }
  return {};
}

// A cluster that holds particles of two components of G: if anything coupled is not connected there is one.
Witness first_ghost_coupling(Judged& judged) {
  const std::vector<int32_t>& component = judged.components().label;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    int32_t first = -1;
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i)) continue;
      if (first < 0) first = i;
      if (component[at(i)] == component[at(first)]) continue;
      return {{judged.number(c)},
              {first, i},
              {},
              fmt::format("cluster {} couples particles {} and {}, which lie in components {} and {} of the tissue",
                          judged.number(c), first, i, component[at(first)], component[at(i)])};
    }
  }
  return {};
}

// Components of the empty nodes (18 neighbours) that do not reach the outer ring.
int32_t count_cavities(Judged& judged) {
  const Grid& grid = judged.body.grid;
  const auto [nx, ny, nz] = grid.nodes;
  if (judged.body.particle_count() == 0) return 0;
  std::vector<uint8_t> empty(at(grid.node_count()), 1);
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i)) empty[at(judged.body.node[at(i)])] = 0;
  }
  // The half of the 18 neighbours that comes earlier in the linear index.
  std::vector<int64_t> earlier;
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int64_t step = di + int64_t{nx} * (dj + int64_t{ny} * dk);
        const int distance = std::abs(di) + std::abs(dj) + std::abs(dk);
        if (step < 0 && distance <= 2) earlier.push_back(step);
      }
    }
  }
  // Node 0 stands for the outside: every node of the ring, which are all empty, and all that touches it.
  DisjointSets sets(grid.node_count());
  const auto on_ring = [&](int32_t i, int32_t j, int32_t k) {
    return i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1;
  };
  for (int32_t k = 0; k < nz; ++k) {
    for (int32_t j = 0; j < ny; ++j) {
      for (int32_t i = 0; i < nx; ++i) {
        const auto node = static_cast<int32_t>(grid.index(i, j, k));
        if (empty[at(node)] == 0) continue;
        if (on_ring(i, j, k)) {
          sets.unite(0, node);
          continue;
        }
        for (const int64_t step : earlier) {
          if (empty[at(node + step)] != 0) sets.unite(node, static_cast<int32_t>(node + step));
        }
        if (i == nx - 2 || j == ny - 2 || k == nz - 2) sets.unite(0, node);
      }
    }
  }
  int32_t cavities = 0;
  for (int32_t node = 1; node < grid.node_count(); ++node) {
    if (empty[at(node)] != 0 && sets.find(node) == node) ++cavities;
  }
  return cavities;
}

// The skin's shells, found from the triangles alone; inside and outside are told apart by the sign of the volume, *at
// rest* where it is judged, because a body that is turned inside out in motion still has the same skin.
struct Shells {
  std::vector<int32_t> of_vertex;  // [v] shell, -1 if no triangle uses the vertex
  std::vector<double> volume;      // [shells] six times [m³]
};

// `points`: where the vertices are.
Shells shells_of(const Skin& skin, const std::vector<Vec3>& points) {
  DisjointSets sets(static_cast<int64_t>(skin.owner.size()));
  std::vector<uint8_t> used(skin.owner.size(), 0);
  for (const auto& t : skin.triangles) {
    sets.unite(t[0], t[1]);
    sets.unite(t[0], t[2]);
    for (const int32_t v : t) used[at(v)] = 1;
  }
  Shells shells;
  shells.of_vertex.assign(skin.owner.size(), -1);
  int32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    const auto root = at(sets.find(static_cast<int32_t>(v)));
    shells.of_vertex[v] = root == v ? count++ : shells.of_vertex[root];
  }
  shells.volume.assign(at(count), 0.0);
  for (const auto& t : skin.triangles) {
    shells.volume[at(shells.of_vertex[at(t[0])])] += dot(points[at(t[0])], cross(points[at(t[1])], points[at(t[2])]));
  }
  return shells;
}

std::vector<Vec3> points_at_rest(const Judged& judged) {
  const Skin& skin = judged.state.skin;
  const double reach = judged.setup.skin.alpha * judged.body.grid.spacing;
  std::vector<Vec3> points(skin.owner.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const auto& d = kDirections[skin.direction[v]];
    points[v] = judged.body.rest_position(skin.owner[v]) + Vec3{reach * d[0], reach * d[1], reach * d[2]};
  }
  return points;
}

void match_skin(Judged& judged, Verdict& verdict, bool with_cgal) {
  const Skin& skin = judged.state.skin;
  const Partition& components = judged.components();
  const Shells shells = shells_of(skin, points_at_rest(judged));
  const auto shell_count = static_cast<int32_t>(shells.volume.size());

  std::vector<int32_t> first_owner(at(shell_count), -1);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t shell = shells.of_vertex[v], owner = skin.owner[v];
    if (shell < 0) continue;
    if (!judged.alive(owner)) {
      violate(verdict, fmt::format("skin vertex {} is owned by particle {}, which is dead", v, owner), {}, {owner});
      continue;
    }
    int32_t& first = first_owner[at(shell)];
    if (first < 0) first = owner;
    if (components.label[at(first)] != components.label[at(owner)]) {
      violate(verdict,
              fmt::format("one shell of the skin joins particles {} and {}, which lie in components {} and "
                          "{} of the tissue",
                          first, owner, components.label[at(first)], components.label[at(owner)]),
              {}, {first, owner});
    }
  }
  // Exactly one outer shell for each component of the tissue.
  std::vector<int32_t> outer_of(at(components.count), -1);
  int32_t inner = 0;
  for (int32_t shell = 0; shell < shell_count; ++shell) {
    const int32_t owner = first_owner[at(shell)];
    if (owner < 0) continue;
    if (shells.volume[at(shell)] < 0) {
      ++inner;
      continue;
    }
    int32_t& outer = outer_of[at(components.label[at(owner)])];
    if (outer >= 0) {
      violate(verdict,
              fmt::format("component {} of the tissue has two outer shells, at particles {} and {}",
                          components.label[at(owner)], first_owner[at(outer)], owner),
              {}, {first_owner[at(outer)], owner});
    }
    outer = shell;
  }
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (!judged.alive(i)) continue;
    int32_t& outer = outer_of[at(components.label[at(i)])];
    if (outer < 0) {
      violate(verdict,
              fmt::format("component {} of the tissue, which holds particle {}, has no outer "
                          "shell",
                          components.label[at(i)], i),
              {}, {i});
      outer = shell_count;  // told once
    }
  }
  const int32_t cavities = count_cavities(judged);
  if (inner != cavities) {
    violate(verdict, fmt::format("the skin has {} inner shells, but the tissue has {} cavities", inner, cavities));
  }
  if (!with_cgal) return;
  const ShellCount counted = skin_shells(skin);
  if (counted.outer + counted.inner != shell_count) {
    violate(verdict, fmt::format("CGAL counts {} shells of the skin, joining triangles at vertices gives "
                                 "{}: shells touch",
                                 counted.outer + counted.inner, shell_count));
  }
}

// A state that is past its first frame must have the skin that its scene wants.
bool skin_is_due(const Judged& judged) {
  return judged.has_skin() || (judged.setup.skin.wanted && judged.state.frame > 0);
}

// How far component match looks at the skin. Shells are counted by joining triangles at their vertices; CGAL joins them
// at their edges. On a surface that is a manifold, which "skin surface" shows, both are the same.
enum class SkinMatch { none, shells, shells_by_cgal_too };

Verdict check_component_match(Judged& judged, SkinMatch skin) {
  Verdict verdict = start_verdict("component match", judged.state, "1", "method.md §2, I3; §8, lemma");
  const Partition& components = judged.components();
  const Partition& coupling = judged.coupling();
  const int64_t pairs = distinct_pairs(components, coupling);
  const int64_t surplus = pairs - components.count, ghosts = pairs - coupling.count;
  if (surplus > 0) {
    const Edge edge = first_uncoupled_edge(judged);
    violate(verdict,
            fmt::format("particles {} and {} are neighbours in component {} of the tissue, but no chain of "
                        "clusters couples them",
                        edge.a, edge.b, components.label[at(edge.a)]),
            {}, {edge.a, edge.b}, {edge.a, edge.b});
  }
  if (ghosts > 0) violate(verdict, first_ghost_coupling(judged));
  verdict.measured = static_cast<double>(surplus + ghosts);
  if (skin != SkinMatch::none && skin_is_due(judged))
    match_skin(judged, verdict, skin == SkinMatch::shells_by_cgal_too);
  for (const int32_t label : components.label) verdict.checked += label >= 0 ? 1 : 0;
  return verdict;
}

Verdict check_isolation(Judged& judged) {
  Verdict verdict = start_verdict("isolation", judged.state, "1", "method.md §2, I3: no isolated cluster");
  const Partition& components = judged.components();
  const Partition& coupling = judged.coupling();
  verdict.checked = coupling.count;
  verdict.measured = static_cast<double>(distinct_pairs(components, coupling) - components.count);
  verdict.holds = verdict.measured == 0;
  if (verdict.holds) return verdict;

  // The smaller of the two groups that meet at an edge without coupling.
  Edge edge = first_uncoupled_edge(judged);
  const auto group_size = [&](int32_t particle) {
    return std::count(coupling.label.begin(), coupling.label.end(), coupling.label[at(particle)]);
  };
  if (group_size(edge.b) < group_size(edge.a)) std::swap(edge.a, edge.b);
  const int32_t group = coupling.label[at(edge.a)];
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i)) continue;
      if (coupling.label[at(i)] == group) verdict.witness.clusters.push_back(judged.number(c));
      break;
    }
  }
  verdict.witness.particles = {edge.a, edge.b};
  verdict.witness.path = {edge.a, edge.b};
  verdict.witness.text = fmt::format(
      "{} of {} clusters form a group of {} particles that shares no particle with any other cluster, though particle "
      "{} of it is a neighbour of particle {}",
      verdict.witness.clusters.size(), judged.clusters.count(), group_size(edge.a), edge.a, edge.b);
  return verdict;
}

// --- I4 --------------------------------------------------------------------------------------------------------------

Verdict check_edge_cover(Judged& judged) {
  Verdict verdict = start_verdict("edge cover", judged.state, "1", "method.md §2, I4");
  if (!judged.state.edge_covered) return verdict;  // not promised
  const UncoveredEdges edges = uncovered_edges(judged.graph, judged.clusters);
  verdict.checked = edges.edges;
  verdict.measured = static_cast<double>(edges.uncovered);
  verdict.holds = edges.uncovered == 0;
  if (!verdict.holds) {
    verdict.witness = {{},
                       {edges.a, edges.b},
                       {edges.a, edges.b},
                       fmt::format("no cluster holds both ends of the edge from particle {} to {}", edges.a, edges.b)};
  }
  return verdict;
}

// --- Rest frames, finite ---------------------------------------------------------------------------------------------

// Bound. A sum of k products of positive weights and coordinates, in any order, is off by at most (k + 2) u Σ w |X|
// per axis to first order in u (Higham 2002, §3.1: k - 1 additions, one product, and one division for w = m / n);
// Σ w by (k + 1) u Σ w; the quotient adds one u. With |X| <= L: (2k + 4) u L per axis, twice that because both sides
// round, √3 for three axes; 8 (k + 2) u L covers it. The mass obeys the same bound relative to itself, because L >= h.
Verdict check_rest_frames(Judged& judged) {
  Verdict verdict =
      start_verdict("rest frames", judged.state, "h", "method.md §5, Rest frames; docs/oracles.md, Rounding");
  const double h = judged.body.grid.spacing;
  const int32_t n = judged.body.particle_count();
  // Dead members count too: between detect and split the frames are those of before.
  const WeightedRest weighted = weighted_rest(judged.body, membership_counts(judged.clusters, n));
  double reach = h;
  for (const Vec3 position : weighted.position) reach = std::max(reach, norm(position));
  int64_t largest = 0;
  int32_t worst = -1;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    if (judged.clusters.size(c) == 0) continue;  // coverage rejects it
    ++verdict.checked;
    largest = std::max(largest, judged.clusters.size(c));
    Vec3 sum;
    double mass = 0;
    for (const int32_t i : judged.clusters.of(c)) {
      sum += weighted.weight[at(i)] * weighted.position[at(i)];
      mass += weighted.weight[at(i)];
    }
    const double center_error = norm(judged.clusters.rest_center[at(c)] - sum / mass) / h;
    const double mass_error = std::abs(judged.clusters.mass[at(c)] - mass) / mass;
    const bool finite_error = std::isfinite(center_error) && std::isfinite(mass_error);
    const double error = finite_error ? std::max(center_error, mass_error) : std::numeric_limits<double>::max();
    if (error >= verdict.measured) {
      verdict.measured = error;
      worst = c;
    }
  }
  verdict.bound = 8.0 * static_cast<double>(largest + 2) * unit_roundoff(judged.state) * reach / h;
  verdict.holds = verdict.measured <= verdict.bound;
  if (!verdict.holds) {
    const Vec3 t = judged.clusters.rest_center[at(worst)];
    verdict.witness = {
        {judged.number(worst)},
        {},
        {},
        fmt::format("rest center ({}, {}, {}) m or mass {} kg of cluster {} is not the weighted sum over "
                    "its {} particles; off by {} h",
                    t.x, t.y, t.z, judged.clusters.mass[at(worst)], judged.number(worst), judged.clusters.size(worst),
                    verdict.measured)};
  }
  return verdict;
}

Verdict check_finite(Judged& judged) {
  Verdict verdict = start_verdict("finite", judged.state, "1", "oracles_and_tests.md §1");
  const auto look = [&](bool finite, std::vector<int32_t> Witness::*kind, int32_t name, const char* what) {
    ++verdict.checked;
    if (finite) return;
    Witness witness;
    witness.text = fmt::format("{} is not finite", what);
    if (kind != nullptr) witness.*kind = {name};
    violate(verdict, std::move(witness));
  };
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    look(is_finite(judged.state.x[at(i)]), &Witness::particles, i, "a position");
    look(is_finite(judged.state.v[at(i)]), &Witness::particles, i, "a velocity");
  }
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    bool rotation = true;
    for (const double entry : judged.clusters.rotation[at(c)].m) rotation = rotation && std::isfinite(entry);
    const int32_t number = judged.number(c);
    look(rotation, &Witness::clusters, number, "a cluster's rotation");
    look(is_finite(judged.clusters.rest_center[at(c)]), &Witness::clusters, number, "a cluster's rest center");
    look(std::isfinite(judged.clusters.mass[at(c)]), &Witness::clusters, number, "a cluster's mass");
  }
  const Skin& skin = judged.state.skin;
  for (std::size_t v = 0; v < skin.position.size(); ++v) {
    ++verdict.checked;
    if (is_finite(skin.position[v])) continue;
    violate(verdict, fmt::format("the position of skin vertex {} is not finite", v), {}, {skin.owner[v]});
  }
  look(is_finite(judged.state.impulse), nullptr, 0, "the impulse");
  return verdict;
}

// --- No pass ---------------------------------------------------------------------------------------------------------

// Local coordinates of the mid-surface: u along the edge, w from the edge to the back, n along the normal.
struct Local {
  double u = 0, n = 0, w = 0;
};

Local to_local(const BladePose& pose, Vec3 p) {
  const Vec3 d = p - pose.edge;
  return {dot(d, pose.along), dot(d, cross(pose.along, pose.back)), dot(d, pose.back)};
}

// Whether the closed segment meets the closed rectangle |u| <= length / 2, 0 <= w <= depth, n = 0. No band is needed:
// both ends of an edge keep the distance ρ from the rectangle and an edge of G is shorter than 2ρ / 1.001, so what
// obeys the lemma misses the rectangle by far more than rounding.
bool crosses(const Blade& blade, Local p, Local q) {
  if ((p.n > 0 && q.n > 0) || (p.n < 0 && q.n < 0)) return false;
  double low = 0, high = 1;  // the part of the segment that lies in the rectangle's plane and slabs
  const auto clip = [&](double a, double b, double least, double most) {
    if (a == b) {
      if (a < least || a > most) high = -1;
      return;
    }
    const double t0 = (least - a) / (b - a), t1 = (most - a) / (b - a);
    low = std::max(low, std::min(t0, t1));
    high = std::min(high, std::max(t0, t1));
  };
  if (p.n != q.n) low = high = p.n / (p.n - q.n);
  const double t = low;
  clip(p.u, q.u, -blade.length / 2, blade.length / 2);
  clip(p.w, q.w, 0, blade.depth);
  // For a segment through the plane the clipped interval must still hold the point in the plane.
  return p.n != q.n ? low <= t && t <= high : low <= high;
}

Verdict check_no_pass(Judged& judged) {
  Verdict verdict = start_verdict("no pass", judged.state, "1", "method.md §3, Blade: lemma of the dynamic cut");
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  // Only where particles keep their distance from the blade *and* stretched ones are removed does the lemma hold.
  if (!setup.has_blade || setup.detect.criterion != Criterion::distance || setup.step.substeps < 1 ||
      state.frame >= setup.frame_count()) {
    return verdict;
  }
  const int64_t substep = (state.frame + 1) * setup.step.substeps - 1;
  if (!setup.blade_moves[at(substep)].down) return verdict;
  const BladePose& pose = setup.blade_moves[at(substep)].to;
  const int32_t n = judged.body.particle_count();
  std::vector<uint8_t> held(at(n), 0);
  for (const Grip& grip : setup.grips) {
    if (grip.active[at(substep)] == 0) continue;
    for (const int32_t i : grip.particles) held[at(i)] = 1;
  }
  std::vector<Local> local(at(n));
  for (int32_t i = 0; i < n; ++i) local[at(i)] = to_local(pose, state.x[at(i)]);
  for (int32_t i = 0; i < n; ++i) {
    if (!judged.alive(i) || held[at(i)] != 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t other = judged.graph.neighbour(i, 2 * axis);
      if (other < 0 || held[at(other)] != 0) continue;
      ++verdict.checked;
      if (!crosses(setup.blade, local[at(i)], local[at(other)])) continue;
      violate(verdict,
              fmt::format("the edge from particle {} to {}, {:.6g} h long, crosses the blade", i, other,
                          norm(state.x[at(i)] - state.x[at(other)]) / judged.body.grid.spacing),
              {}, {i, other}, {i, other});
    }
  }
  return verdict;
}

// --- Merge maximality ------------------------------------------------------------------------------------------------

Verdict check_merge_maximality(Judged& judged) {
  Verdict verdict = start_verdict("merge maximality", judged.state, "1", "method.md §6: maximal");
  const MergeRule rule = judged.setup.merge.rule;
  if (rule != MergeRule::deterministic && rule != MergeRule::published) return verdict;
  const Clusters& clusters = judged.clusters;
  const Memberships memberships = memberships_of(clusters, judged.body.particle_count());
  std::vector<int32_t> seen_by(at(clusters.count()), -1);  // the last small cluster that touched it
  std::vector<int64_t> shared(at(clusters.count()), 0);    // particles shared with that one
  std::vector<Edge> contact(at(clusters.count()));         // where they touch
  std::vector<int32_t> touched;
  for (int32_t s = 0; s < clusters.count(); ++s) {
    const int64_t size = clusters.size(s);
    if (size >= judged.state.tau || size == 0) continue;
    ++verdict.checked;
    touched.clear();
    const auto touch = [&](int32_t t, int32_t from, int32_t to) {
      if (seen_by[at(t)] == s) return;
      seen_by[at(t)] = s;
      shared[at(t)] = 0;
      contact[at(t)] = {from, to};
      touched.push_back(t);
    };
    for (const int32_t i : clusters.of(s)) {
      for (const int32_t t : memberships.of(i)) {
        touch(t, i, i);
        ++shared[at(t)];
      }
      if (!judged.alive(i)) continue;
      for (int direction = 0; direction < 6; ++direction) {
        const int32_t other = judged.graph.neighbour(i, direction);
        if (other < 0) continue;
        for (const int32_t t : memberships.of(other)) touch(t, i, other);
      }
    }
    for (const int32_t t : touched) {
      const int64_t joined = size + clusters.size(t) - shared[at(t)];
      const bool contained = shared[at(t)] == size;
      if (t == s || (!contained && joined > judged.state.cap)) continue;
      std::vector<int32_t> particles = {contact[at(t)].a};
      if (contact[at(t)].b != contact[at(t)].a) particles.push_back(contact[at(t)].b);
      violate(verdict,
              fmt::format("cluster {} has {} particles, fewer than tau = {}, and could still merge into "
                          "cluster {}: together {} particles, cap = {}{}",
                          judged.number(s), size, judged.state.tau, judged.number(t), joined, judged.state.cap,
                          contained ? ", contained in it" : ""),
              {judged.number(s), judged.number(t)}, particles);
      break;
    }
  }
  return verdict;
}

template <typename Check>
Verdict gated(const char* property, const Setup& setup, const State& state, Check check) {
  const Verdict form = check_form(setup, state);
  if (!form.holds) return not_judged(property, form);
  Judged judged(setup, state);
  return check(judged);
}

}  // namespace

Verdict well_formed(const Setup& setup, const State& state) { return check_form(setup, state); }

Verdict cluster_connectivity(const Setup& setup, const State& state) {
  return gated("cluster connectivity", setup, state, check_connectivity);
}
Verdict coverage(const Setup& setup, const State& state) { return gated("coverage", setup, state, check_coverage); }
Verdict component_match(const Setup& setup, const State& state) {
  return gated("component match", setup, state,
               [](Judged& judged) { return check_component_match(judged, SkinMatch::shells_by_cgal_too); });
}
Verdict isolation(const Setup& setup, const State& state) { return gated("isolation", setup, state, check_isolation); }
Verdict edge_cover(const Setup& setup, const State& state) {
  return gated("edge cover", setup, state, check_edge_cover);
}
Verdict rest_frames(const Setup& setup, const State& state) {
  return gated("rest frames", setup, state, check_rest_frames);
}
Verdict finite(const Setup& setup, const State& state) { return gated("finite", setup, state, check_finite); }
Verdict no_pass(const Setup& setup, const State& state) { return gated("no pass", setup, state, check_no_pass); }
Verdict merge_maximality(const Setup& setup, const State& state) {
  return gated("merge maximality", setup, state, check_merge_maximality);
}

// --- All of them -----------------------------------------------------------------------------------------------------

struct Judge::Memory {
  explicit Memory(const Setup& of_setup) : setup(of_setup) {}

  // A verdict that holds, of a state that had the same bits in all parts that it rests on.
  struct Held {
    std::string property;
    SkinMatch skin;  // of "component match"
    unsigned parts;
    Verdict verdict;
  };

  const Setup& setup;
  bool body_is_known_good = false;
  const State* last = nullptr;
  std::unique_ptr<Judged> judged;  // `last`, where it is well formed
  Verdict form;                    // of `last`
  std::vector<Held> held;

  // Makes `state` the last one, and forgets what rests on parts that have changed.
  void look_at(const State& state) {
    if (&state == last) return;
    const unsigned changed = last == nullptr ? kAll : parts_that_differ(*last, state);
    std::erase_if(held, [&](const Held& h) { return (h.parts & changed) != 0; });
    const bool last_is_good = last != nullptr && form.holds;
    form = check_form(setup, state, last_is_good ? kBody | (kAll & ~changed) : body_is_known_good ? kBody : 0u);
    if (form.holds) body_is_known_good = true;
    auto next = std::make_unique<Judged>(setup, state);
    if (last_is_good && form.holds) next->take_over(*judged, changed);
    judged = std::move(next);
    last = &state;
  }

  template <typename Check>
  Verdict ask(const char* property, unsigned parts, Check check, SkinMatch skin = SkinMatch::none) {
    if (!form.holds) return not_judged(property, form);
    const auto known =
        std::find_if(held.begin(), held.end(), [&](const Held& h) { return h.property == property && h.skin == skin; });
    if (known != held.end()) {
      Verdict verdict = known->verdict;
      verdict.frame = last->frame;
      return verdict;
    }
    Verdict verdict = check(*judged);
    if (verdict.holds) held.push_back({property, skin, parts, verdict});
    return verdict;
  }

  Verdict ask_finite() { return ask("finite", kMotion | kFrames | kRotations | kSkin, check_finite); }
  Verdict ask_rest_frames() { return ask("rest frames", kSets | kFrames, check_rest_frames); }
  Verdict ask_merge_maximality() { return ask("merge maximality", kAlive | kSets | kLimits, check_merge_maximality); }
  // Not kept: it rests on the frame's blade.
  Verdict ask_no_pass() { return form.holds ? check_no_pass(*judged) : not_judged("no pass", form); }
};

Judge::Judge(const Setup& setup) : memory_(std::make_unique<Memory>(setup)) {}
Judge::~Judge() = default;

int32_t Judge::component_count(const State& state) {
  memory_->look_at(state);
  return memory_->form.holds ? memory_->judged->components().count : 0;
}

int32_t Judge::inner_shells(const State& state) {
  memory_->look_at(state);
  if (!memory_->form.holds) return 0;
  const Shells shells = shells_of(state.skin, state.skin.position);
  return static_cast<int32_t>(
      std::count_if(shells.volume.begin(), shells.volume.end(), [](double volume) { return !(volume > 0); }));
}

std::vector<Verdict> Judge::state(const State& state, Stage after, bool thorough) {
  // Between detect and split clusters hold dead particles. Until expansion, groups may be uncoupled, unless I4
  // forbids it. Expansion may leave clusters that could merge. The skin is up to date only after its own stage.
  Memory& m = *memory_;
  m.look_at(state);
  const Setup& setup = m.setup;
  const bool split_done = after != Stage::detect;
  const bool coupled = split_done && (after == Stage::step || after >= Stage::expand || state.edge_covered);
  const bool merged = split_done && after != Stage::split &&
                      (after == Stage::merge || state.edge_covered || setup.expand.rule == ExpandRule::none);
  const bool maximal = setup.merge.rule == MergeRule::deterministic || setup.merge.rule == MergeRule::published;
  const bool skin_here = after == Stage::skin && skin_is_due(*m.judged);

  std::vector<Verdict> verdicts = {m.form};
  const auto add = [&](bool applies, auto ask) {
    if (applies) verdicts.push_back(ask());
  };
  const auto of_skin = [&](auto check) { return [&setup, &state, check](Judged&) { return check(setup, state); }; };
  add(true, [&] { return m.ask_finite(); });
  add(split_done, [&] { return m.ask("cluster connectivity", kAlive | kSets, check_connectivity); });
  add(split_done, [&] { return m.ask("coverage", kAlive | kSets | kCut, check_coverage); });
  add(coupled, [&] {
    const SkinMatch skin = !skin_here ? SkinMatch::none : thorough ? SkinMatch::shells_by_cgal_too : SkinMatch::shells;
    return m.ask(
        "component match", kAlive | kSets | (skin_here ? kSkin : 0u),
        [&](Judged& judged) { return check_component_match(judged, skin); }, skin);
  });
  add(coupled, [&] { return m.ask("isolation", kAlive | kSets, check_isolation); });
  add(split_done && state.edge_covered,
      [&] { return m.ask("edge cover", kAlive | kSets | kLimits, check_edge_cover); });
  add(true, [&] { return m.ask_rest_frames(); });
  add(true, [&] { return m.ask("rotation", kRotations, of_skin(check_rotation_quality)); });
  add(merged && maximal, [&] { return m.ask_merge_maximality(); });
  add(after == Stage::detect && setup.has_blade, [&] { return m.ask_no_pass(); });
  add(skin_here, [&] { return m.ask("skin surface", kAlive | kSkin, of_skin(skin_surface)); });
  add(skin_here, [&] {
    return m.ask("skin vertices", kAlive | kSkin | kSets | kFrames | kRotations | kMotion,
                 of_skin(check_skin_vertices));
  });
  add(skin_here && thorough, [&] { return m.ask("skin geometry", kAlive | kSkin, of_skin(skin_geometry)); });
  for (Verdict& verdict : verdicts) verdict.stage = after;
  return verdicts;
}

std::vector<Verdict> Judge::stage(Stage stage, const State& before, const State& after) {
  Memory& m = *memory_;
  m.look_at(before);
  const Verdict form_before = m.form;
  m.look_at(after);
  std::vector<Verdict> verdicts;
  const auto add = [&](Verdict verdict) { verdicts.push_back(std::move(verdict)); };
  const auto add_own = [&] { add(stage_verdict(m.setup, stage, before, form_before, after, m.form)); };
  switch (stage) {
    case Stage::step:
      add(momentum_verdict(m.setup, before, form_before, after, m.form));
      add(m.ask_finite());
      break;
    case Stage::detect:
      add_own();
      if (m.setup.has_blade) add(m.ask_no_pass());
      break;
    case Stage::merge:
      add_own();
      if (m.setup.merge.rule == MergeRule::deterministic || m.setup.merge.rule == MergeRule::published) {
        add(m.ask_merge_maximality());
      }
      add(m.ask_rest_frames());
      break;
    case Stage::split:
    case Stage::expand:
      add_own();
      add(m.ask_rest_frames());
      break;
    case Stage::skin:
      break;
  }
  add(untouched_verdict(m.setup, stage, before, form_before, after, m.form));
  for (Verdict& verdict : verdicts) verdict.stage = stage;
  return verdicts;
}

std::vector<Verdict> judge(const Setup& setup, const State& state, Stage after, bool thorough) {
  return Judge(setup).state(state, after, thorough);
}
std::vector<Verdict> judge(const Setup& setup, const State& state, bool thorough) {
  return judge(setup, state, Stage::skin, thorough);
}
std::vector<Verdict> judge_stage(const Setup& setup, Stage stage, const State& before, const State& after) {
  return Judge(setup).stage(stage, before, after);
}

}  // namespace cutproof::oracles
