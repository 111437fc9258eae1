// Partitions of the alive particles: components of the tissue graph, and of the coupling by clusters.
#include <algorithm>
#include <map>
#include <set>

#include "oracles/oracles.h"
#include "oracles/rest_places.h"
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

UncoveredEdges uncovered_edges(const TissueGraph& graph, const Clusters& clusters) {
  const int32_t n = graph.particle_count();
  std::vector<int64_t> first = {0};  // [n + 1] the index of a particle's first edge to a greater one
  for (int32_t i = 0; i < n; ++i) first.push_back(first.back() + graph.upper_neighbours(i).size());
  std::vector<uint8_t> covered(at(first.back()), 0);
  std::vector<int32_t> held_by(at(n), -1);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    for (const int32_t i : clusters.of(c)) held_by[at(i)] = c;
    for (const int32_t i : clusters.of(c)) {
      int64_t edge = first[at(i)];
      for (const int32_t other : graph.upper_neighbours(i)) {
        if (held_by[at(other)] == c) covered[at(edge)] = 1;
        ++edge;
      }
    }
  }
  UncoveredEdges result;
  result.edges = first.back();
  for (int32_t i = 0; i < n; ++i) {
    int64_t edge = first[at(i)];
    for (const int32_t other : graph.upper_neighbours(i)) {
      if (covered[at(edge++)] == 0) result.uncovered.push_back({i, other});
    }
  }
  std::sort(result.uncovered.begin(), result.uncovered.end());
  return result;
}

Partition graph_components(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return {};
  return graph_components(setup.body, state.alive);
}

Partition graph_components(const Body& body, const std::vector<uint8_t>& alive) {
  return components_of_graph(TissueGraph(body, alive));
}

Partition coupling_components(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return {};
  return components_of_coupling(TissueGraph(setup.body, state.alive), state.clusters);
}

WeakCouplings weak_couplings(const Setup& setup, const State& state) {
  WeakCouplings weak;
  if (!well_formed(setup, state).holds) return weak;
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  for (int32_t c = 0; c < clusters.count(); ++c) {
    std::map<int32_t, std::vector<int32_t>> shared;  // with each later cluster: living particles
    for (const int32_t i : clusters.of(c)) {
      for (const int32_t other : memberships.of(i)) {
        if (other > c && state.alive[at(i)] != 0) shared[other].push_back(i);
      }
    }
    for (const auto& [other, particles] : shared) {
      if (particles.size() == 1) {
        ++weak.ball_joints;
      } else if (is_on_a_line(body, particles)) {
        ++weak.hinges;
      }
    }
  }
  return weak;
}

}  // namespace cutproof::oracles
