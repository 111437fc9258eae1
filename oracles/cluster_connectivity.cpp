// I1 (method.md §2): each cluster is connected in G.
#include <algorithm>

#include "oracles/checks.h"

namespace cutproof::oracles {

// The property coverage judges dead members; here only living members count.
void check_cluster_connectivity(Judged& judged, Verdict& verdict) {
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
      for (const int32_t other : judged.graph.neighbours(queue[head])) {
        if (member_of[at(other)] != c || reached_in[at(other)] == c) continue;
        reached_in[at(other)] = c;
        queue.push_back(other);
      }
    }
    const auto reached = static_cast<int32_t>(queue.size());
    if (reached == size) continue;
    judged.connected[at(c)] = 0;
    const auto members = judged.clusters.of(c);
    const int32_t missed = *std::find_if(members.begin(), members.end(),
                                         [&](int32_t i) { return judged.alive(i) && reached_in[at(i)] != c; });
    violate(verdict, {{judged.number(c)}, {seed, missed}},
            "cluster {} is not connected: {} of its {} particles are reached from particle {}, particle {} is not",
            judged.number(c), reached, size, seed, missed);
  }
}

}  // namespace cutproof::oracles
