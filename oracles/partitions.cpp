// Partitions of the alive particles: components of the tissue graph, and of the coupling by clusters.
#include "oracles/oracles.h"
#include "oracles/support.h"

namespace cutproof::oracles {

Partition components_of_graph(const TissueGraph& graph) {
  const int32_t n = graph.particle_count();
  Partition partition;
  partition.label.assign(at(n), -1);
  std::vector<int32_t> queue;
  queue.reserve(at(n));
  for (int32_t seed = 0; seed < n; ++seed) {
    if (!graph.alive(seed) || partition.label[at(seed)] >= 0) continue;
    queue.clear();
    queue.push_back(seed);
    partition.label[at(seed)] = partition.count;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      for (int direction = 0; direction < 6; ++direction) {
        const int32_t other = graph.neighbour(queue[head], direction);
        if (other < 0 || partition.label[at(other)] >= 0) continue;
        partition.label[at(other)] = partition.count;
        queue.push_back(other);
      }
    }
    ++partition.count;
  }
  return partition;
}

Partition components_of_coupling(const TissueGraph& graph, const Clusters& clusters) {
  const int32_t n = graph.particle_count();
  DisjointSets sets(n);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    int32_t first = -1;
    for (const int32_t i : clusters.of(c)) {
      if (!graph.alive(i)) continue;
      if (first < 0) first = i;
      sets.unite(first, i);
    }
  }
  Partition partition;
  partition.label.assign(at(n), -1);
  for (int32_t i = 0; i < n; ++i) {
    if (!graph.alive(i)) continue;
    const int32_t root = sets.find(i);  // the smallest of its set, so labelled before i
    partition.label[at(i)] = root == i ? partition.count++ : partition.label[at(root)];
  }
  return partition;
}

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

std::vector<uint8_t> covered_edges(const TissueGraph& graph, const Clusters& clusters) {
  std::vector<uint8_t> covered(at(graph.particle_count()) * 3, 0);
  std::vector<int32_t> held_by(at(graph.particle_count()), -1);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    for (const int32_t i : clusters.of(c)) held_by[at(i)] = c;
    for (const int32_t i : clusters.of(c)) {
      for (int axis = 0; axis < 3; ++axis) {
        const int32_t other = graph.neighbour(i, 2 * axis);
        if (other >= 0 && held_by[at(other)] == c) covered[at(i) * 3 + at(axis)] = 1;
      }
    }
  }
  return covered;
}

UncoveredEdges uncovered_edges(const TissueGraph& graph, const Clusters& clusters) {
  const std::vector<uint8_t> covered = covered_edges(graph, clusters);
  UncoveredEdges result;
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    if (!graph.alive(i)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t other = graph.neighbour(i, 2 * axis);
      if (other < 0) continue;
      ++result.edges;
      if (covered[at(i) * 3 + at(axis)] != 0) continue;
      if (result.uncovered++ == 0) {
        result.a = i;
        result.b = other;
      }
    }
  }
  return result;
}

Partition graph_components(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return {};
  return components_of_graph(TissueGraph(setup.body, state.alive));
}

Partition coupling_components(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return {};
  return components_of_coupling(TissueGraph(setup.body, state.alive), state.clusters);
}

namespace {

// Exact: nodes have integer coordinates.
bool collinear(const Grid& grid, int64_t a, int64_t b, int64_t c) {
  const auto p = grid.coordinates(a), q = grid.coordinates(b), r = grid.coordinates(c);
  const std::array<int64_t, 3> u = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
  const std::array<int64_t, 3> v = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
  return u[1] * v[2] == u[2] * v[1] && u[2] * v[0] == u[0] * v[2] && u[0] * v[1] == u[1] * v[0];
}

}  // namespace

WeakCouplings weak_couplings(const Setup& setup, const State& state) {
  WeakCouplings weak;
  if (!well_formed(setup, state).holds) return weak;
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  // What cluster c shares with each later cluster: how many particles, the first two, and whether all are collinear.
  struct Shared {
    int32_t count = 0, first = -1, second = -1;
    bool on_a_line = true;
  };
  std::vector<Shared> shared(at(clusters.count()));
  std::vector<int32_t> partners;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    partners.clear();
    for (const int32_t i : clusters.of(c)) {
      for (const int32_t other : memberships.of(i)) {
        if (other <= c || state.alive[at(i)] == 0) continue;
        Shared& s = shared[at(other)];
        if (s.count++ == 0) {
          partners.push_back(other);
          s.first = i;
        } else if (s.count == 2) {
          s.second = i;
        } else if (s.on_a_line) {
          s.on_a_line = collinear(body.grid, body.node[at(s.first)], body.node[at(s.second)], body.node[at(i)]);
        }
      }
    }
    for (const int32_t other : partners) {
      const Shared& s = shared[at(other)];
      if (s.count == 1) {
        ++weak.ball_joints;
      } else if (s.on_a_line) {
        ++weak.hinges;
      }
      shared[at(other)] = Shared{};
    }
  }
  return weak;
}

}  // namespace cutproof::oracles
