// Shared by split, merge and expand.
#pragma once
#include <cstddef>
#include <span>

#include "model/clusters.h"

namespace cutproof::reference {

// Appends a cluster with these members (strictly ascending) and this number; rotation and degenerate flag are those
// of cluster `parent` of `from`. Rest frames are left to update_rest_frames().
inline void append_cluster(Clusters& to, std::span<const int32_t> members, int32_t number, const Clusters& from,
                           int32_t parent) {
  const auto p = static_cast<std::size_t>(parent);
  to.members.insert(to.members.end(), members.begin(), members.end());
  to.offsets.push_back(static_cast<int64_t>(to.members.size()));
  to.number.push_back(number);
  to.rotation.push_back(from.rotation[p]);
  to.degenerate.push_back(from.degenerate[p]);
}

}  // namespace cutproof::reference
