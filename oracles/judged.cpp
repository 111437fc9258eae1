#include "oracles/judged.h"

#include <algorithm>

namespace cutproof::oracles {

Judged::Judged(const Setup& of_setup, const State& of_state)
    : setup(of_setup),
      state(of_state),
      body(of_setup.body),
      clusters(of_state.clusters),
      graph(of_setup.body, of_state.alive) {}

const Partition& Judged::components() {
  if (!components_) components_ = components_of_graph(graph);
  return *components_;
}

const Partition& Judged::coupling() {
  if (!coupling_) coupling_ = components_of_coupling(graph, clusters);
  return *coupling_;
}

int64_t Judged::coupled_components() {
  if (!coupled_components_) coupled_components_ = distinct_pairs(components(), coupling());
  return *coupled_components_;
}

const Memberships& Judged::memberships() {
  if (!memberships_) memberships_ = memberships_of(clusters, body.particle_count());
  return *memberships_;
}

Edge Judged::first_uncoupled_edge() {
  const std::vector<int32_t>& coupled = coupling().label;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (const int32_t other : graph.upper_neighbours(i)) {
      if (coupled[at(i)] != coupled[at(other)]) return {i, other};
    }
  }
  return {};
}

void Judged::take_over(Judged& last, unsigned differ) {
  if ((differ & kAlive) == 0) components_ = std::move(last.components_);
  if ((differ & kSets) == 0) memberships_ = std::move(last.memberships_);
  if ((differ & (kAlive | kSets)) == 0) {
    coupling_ = std::move(last.coupling_);
    coupled_components_ = last.coupled_components_;
  }
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

}  // namespace cutproof::oracles
