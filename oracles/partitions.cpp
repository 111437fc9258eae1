// Partitions of the alive particles: components of the tissue graph, and of the coupling by clusters.
#include <algorithm>
#include <map>
#include <set>

#include "oracles/oracles.h"
#include "oracles/support.h"

namespace cutproof::oracles {

Partition components_of_graph(const TissueGraph& graph) {
  const int32_t n = graph.particle_count();
  Partition partition;
  partition.label.assign(at(n), -1);
  std::vector<int32_t> queue;

  for (int32_t seed = 0; seed < n; ++seed) {
    if (!graph.alive(seed) || partition.label[at(seed)] >= 0) continue;
    queue.assign(1, seed);
    partition.label[at(seed)] = partition.count;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      for (const int32_t other : graph.neighbours(queue[head])) {
        if (partition.label[at(other)] >= 0) continue;
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
  std::set<std::pair<int32_t, int32_t>> pairs;
  for (std::size_t i = 0; i < a.label.size(); ++i) {
    if (a.label[i] >= 0) pairs.emplace(a.label[i], b.label[i]);
  }
  return static_cast<int64_t>(pairs.size());
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
  const auto from_a = [&, p = grid.coordinates(a)](int64_t node) {
    const auto q = grid.coordinates(node);
    return Vec3{1.0 * (q[0] - p[0]), 1.0 * (q[1] - p[1]), 1.0 * (q[2] - p[2])};
  };
  return cross(from_a(b), from_a(c)) == Vec3{};
}

}  // namespace

WeakCouplings weak_couplings(const Setup& setup, const State& state) {
  WeakCouplings weak;
  if (!well_formed(setup, state).holds) return weak;
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  for (int32_t c = 0; c < clusters.count(); ++c) {
    std::map<int32_t, std::vector<int64_t>> shared;  // with each later cluster: the nodes of living particles
    for (const int32_t i : clusters.of(c)) {
      for (const int32_t other : memberships.of(i)) {
        if (other > c && state.alive[at(i)] != 0) shared[other].push_back(body.node[at(i)]);
      }
    }
    for (const auto& [other, nodes] : shared) {
      const auto on_a_line = [&grid = body.grid, a = nodes.front(), b = nodes.back()](int64_t node) {
        return collinear(grid, a, b, node);
      };
      if (nodes.size() == 1) {
        ++weak.ball_joints;
      } else if (std::all_of(nodes.begin(), nodes.end(), on_a_line)) {
        ++weak.hinges;
      }
    }
  }
  return weak;
}

}  // namespace cutproof::oracles
