// Which clusters hold a particle. Internal to oracles/.
#pragma once
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/clusters.h"

namespace cutproof::oracles {

// Values by a key, 0 .. keys - 1, as compressed rows; those of one key in the order in which they were given.
template <class T>
class Rows {
 public:
  Rows(int32_t keys, const std::vector<std::pair<int32_t, T>>& given) : offsets_(at(keys) + 1), values_(given.size()) {
    for (const auto& [key, value] : given) ++offsets_[at(key) + 1];
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    std::vector<std::size_t> next = offsets_;
    for (const auto& [key, value] : given) values_[next[at(key)]++] = value;
  }
  std::span<const T> of(int32_t key) const {
    const auto k = at(key);
    return {values_.data() + offsets_[k], offsets_[k + 1] - offsets_[k]};
  }

 private:
  std::vector<std::size_t> offsets_;
  std::vector<T> values_;
};

// For each particle the clusters (indices, ascending) that hold it.
using Memberships = Rows<int32_t>;

// Of clusters whose members are particles 0 .. particle_count - 1.
Memberships memberships_of(const Clusters& clusters, int32_t particle_count);

// n_i: in how many clusters each particle lies [n].
std::vector<int32_t> membership_counts(const Clusters& clusters, int32_t particle_count);

}  // namespace cutproof::oracles
