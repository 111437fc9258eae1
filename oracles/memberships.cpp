#include "oracles/memberships.h"

#include "oracles/support.h"

namespace cutproof::oracles {

Memberships memberships_of(const Clusters& clusters, int32_t particle_count) {
  std::vector<std::pair<int32_t, int32_t>> pairs;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    for (const int32_t i : clusters.of(c)) pairs.emplace_back(i, c);
  }
  return {particle_count, pairs};
}

std::vector<int32_t> membership_counts(const Clusters& clusters, int32_t particle_count) {
  std::vector<int32_t> count(at(particle_count), 0);
  for (const int32_t i : clusters.members) ++count[at(i)];
  return count;
}

}  // namespace cutproof::oracles
