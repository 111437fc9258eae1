// Expand (method.md §7): clusters take in neighbouring particles, so that connected tissue is coupled.
//
// A cluster takes in particles only along edges of G, so it stays connected (I1). After edge_cover each edge of G lies
// in a cluster (I4), so no group of clusters is isolated (method.md §2, lemma).
#include <algorithm>
#include <iterator>
#include <utility>

#include "reference_cpu/append_cluster.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {
namespace {

// A cluster (index) and the particle that it takes in. Lists of these are sorted, without duplicates.
using Addition = std::pair<int32_t, int32_t>;

void sort_unique(std::vector<Addition>& additions) {
  std::sort(additions.begin(), additions.end());
  additions.erase(std::unique(additions.begin(), additions.end()), additions.end());
}

bool share_a_cluster(const Memberships& memberships, int32_t a, int32_t b) {
  const auto of_a = memberships.of(a), of_b = memberships.of(b);
  auto i = of_a.begin();
  auto k = of_b.begin();
  while (i != of_a.end() && k != of_b.end()) {
    if (*i == *k) return true;
    *i < *k ? ++i : ++k;
  }
  return false;
}

bool holds(const Memberships& memberships, int32_t particle, int32_t cluster) {
  const auto clusters = memberships.of(particle);
  return std::binary_search(clusters.begin(), clusters.end(), cluster);
}

// For every edge of G that no cluster contains: the smallest cluster at one of its ends takes in the other end. Of
// equally small clusters the lowest number decides.
std::vector<Addition> cover_edges(const Body& body, const State& state, const Memberships& memberships) {
  std::vector<Addition> additions;
  for (int32_t a = 0; a < body.particle_count(); ++a) {
    if (!state.alive[static_cast<std::size_t>(a)]) continue;
    for (const int32_t b : body.neighbours(a)) {
      if (b < a) continue;  // each edge once
      if (!state.alive[static_cast<std::size_t>(b)] || share_a_cluster(memberships, a, b)) continue;
      // (size, cluster, particle that it takes in); cluster indices are in the order of numbers.
      std::pair<int64_t, Addition> least = {-1, {}};
      const auto consider = [&](int32_t inside, int32_t outside) {
        for (const int32_t c : memberships.of(inside)) {
          const std::pair<int64_t, Addition> candidate = {state.clusters.size(c), {c, outside}};
          if (least.first < 0 || candidate < least) least = candidate;
        }
      };
      consider(a, b);
      consider(b, a);
      if (least.first >= 0) additions.push_back(least.second);
    }
  }
  return additions;
}

// The paper's rule (§2.2.2), cluster by cluster: a cluster that shares no particle takes in the outside ends of the
// edges of G that leave it.
std::vector<Addition> free_lone_clusters(const Body& body, const State& state, const Memberships& memberships) {
  std::vector<Addition> additions;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    const auto members = state.clusters.of(c);
    const auto is_shared = [&](int32_t p) { return memberships.count(p) > 1; };
    if (std::any_of(members.begin(), members.end(), is_shared)) continue;
    for (const int32_t p : members) {
      if (!state.alive[static_cast<std::size_t>(p)]) continue;
      for (const int32_t q : body.neighbours(p)) {
        if (!state.alive[static_cast<std::size_t>(q)] || holds(memberships, q, c)) continue;
        additions.push_back({c, q});
      }
    }
  }
  return additions;
}

// Adds one layer to each growing cluster: G-neighbours of its last additions that share a cluster of the stage's input
// with them. `all`: every addition so far, sorted.
std::vector<Addition> next_layer(const Body& body, const State& state, const Memberships& memberships,
                                 const std::vector<Addition>& last, const std::vector<Addition>& all) {
  std::vector<Addition> layer;
  for (const auto& [cluster, p] : last) {
    for (const int32_t q : body.neighbours(p)) {
      if (!state.alive[static_cast<std::size_t>(q)] || !share_a_cluster(memberships, p, q)) continue;
      const Addition addition = {cluster, q};
      if (holds(memberships, q, cluster) || std::binary_search(all.begin(), all.end(), addition)) continue;
      layer.push_back(addition);
    }
  }
  sort_unique(layer);
  return layer;
}

Clusters grown(const Clusters& before, const std::vector<Addition>& additions) {
  Clusters after;
  auto next = additions.begin();
  for (int32_t c = 0; c < before.count(); ++c) {
    const auto members = before.of(c);
    std::vector<int32_t> more;
    for (; next != additions.end() && next->first == c; ++next) more.push_back(next->second);
    std::vector<int32_t> both;
    std::merge(members.begin(), members.end(), more.begin(), more.end(), std::back_inserter(both));
    append_cluster(after, both, before.number[static_cast<std::size_t>(c)], before, c);
  }
  return after;
}

}  // namespace

void expand(const Setup& setup, State& state) {
  const ExpandRule rule = setup.expand.rule;
  if (rule == ExpandRule::none) return;
  const Memberships memberships = memberships_of(state.clusters, setup.body.particle_count());
  std::vector<Addition> all = rule == ExpandRule::edge_cover ? cover_edges(setup.body, state, memberships)
                                                             : free_lone_clusters(setup.body, state, memberships);
  sort_unique(all);
  std::vector<Addition> last = all;
  for (int32_t layer = 1; layer < setup.expand.depth && !last.empty(); ++layer) {
    last = next_layer(setup.body, state, memberships, last, all);
    std::vector<Addition> joined;
    std::merge(all.begin(), all.end(), last.begin(), last.end(), std::back_inserter(joined));
    all = std::move(joined);
  }

  if (rule == ExpandRule::edge_cover) state.edge_covered = true;
  if (all.empty()) return;
  state.clusters = grown(state.clusters, all);
  update_rest_frames(setup.body, state.clusters);
}

}  // namespace cutproof::reference
