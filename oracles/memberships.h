// Which clusters hold a particle. Internal to oracles/.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "model/clusters.h"

namespace cutproof::oracles {

// For each particle the clusters (indices, ascending) that hold it, as compressed rows.
struct Memberships {
  std::vector<int64_t> offsets;   // [n + 1]
  std::vector<int32_t> clusters;  // [members]
  std::span<const int32_t> of(int32_t particle) const {
    const auto i = static_cast<std::size_t>(particle);
    return {clusters.data() + offsets[i], static_cast<std::size_t>(offsets[i + 1] - offsets[i])};
  }
};

// Of clusters whose members are particles 0 .. particle_count - 1.
Memberships memberships_of(const Clusters& clusters, int32_t particle_count);

// n_i: in how many clusters each particle lies [n].
std::vector<int32_t> membership_counts(const Clusters& clusters, int32_t particle_count);

}  // namespace cutproof::oracles
