#include "oracles/piece_sizes.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "model/at.h"

namespace cutproof::oracles {

std::string pieces_in_words(const Partition& partition) {
  constexpr std::size_t kMostShown = 5;
  if (partition.count <= 0) return "no piece";
  std::vector<int64_t> sizes(at(partition.count), 0);
  for (const int32_t label : partition.label) {
    if (label >= 0) ++sizes[at(label)];
  }
  std::sort(sizes.begin(), sizes.end(), std::greater<>());
  if (sizes.size() == 1) return fmt::format("1 piece (of {} particles)", sizes[0]);
  std::string listed;
  const std::size_t shown = std::min(sizes.size(), kMostShown);
  for (std::size_t k = 0; k < shown; ++k) {
    const char* const before = k == 0 ? "" : k + 1 == sizes.size() ? " and " : ", ";
    listed += before + std::to_string(sizes[k]);
  }
  if (shown < sizes.size()) listed += ", …";
  return fmt::format("{} pieces (of {} particles)", sizes.size(), listed);
}

}  // namespace cutproof::oracles
