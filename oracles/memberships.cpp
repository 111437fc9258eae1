#include "oracles/memberships.h"

#include "oracles/support.h"

namespace cutproof::oracles {

Memberships memberships_of(const Clusters& clusters, int32_t particle_count) {
  Memberships memberships;
  memberships.offsets.assign(at(particle_count) + 1, 0);
  for (const int32_t i : clusters.members) ++memberships.offsets[at(i) + 1];
  for (std::size_t i = 0; i < at(particle_count); ++i) memberships.offsets[i + 1] += memberships.offsets[i];
  memberships.clusters.resize(clusters.members.size());
  std::vector<int64_t> next(memberships.offsets.begin(), memberships.offsets.end() - 1);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    for (const int32_t i : clusters.of(c)) memberships.clusters[at(next[at(i)]++)] = c;
  }
  return memberships;
}

std::vector<int32_t> membership_counts(const Clusters& clusters, int32_t particle_count) {
  std::vector<int32_t> count(at(particle_count), 0);
  for (const int32_t i : clusters.members) ++count[at(i)];
  return count;
}

}  // namespace cutproof::oracles
