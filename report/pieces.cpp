#include "report/pieces.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace cutproof::report {

namespace {

// Members of the k-th cluster, none where its extent lies outside.
std::span<const int32_t> extent(const Clusters& clusters, std::size_t k) {
  if (k + 1 >= clusters.offsets.size()) return {};
  const int64_t first = clusters.offsets[k], end = clusters.offsets[k + 1];
  if (first < 0 || end < first || end > std::ssize(clusters.members)) return {};
  return std::span(clusters.members).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(end - first));
}

}  // namespace

Pieces pieces_of(const Body& body, const std::vector<uint8_t>& alive) {
  const int32_t n = body.particle_count();
  Pieces pieces;
  pieces.of.assign(static_cast<std::size_t>(n), -1);
  std::vector<int64_t> sizes;
  std::vector<int32_t> reached;
  for (int32_t start = 0; start < n; ++start) {
    if (alive[static_cast<std::size_t>(start)] == 0 || pieces.of[static_cast<std::size_t>(start)] >= 0) continue;
    const auto piece = static_cast<int32_t>(sizes.size());
    pieces.of[static_cast<std::size_t>(start)] = piece;
    reached.assign(1, start);
    int64_t size = 0;
    while (!reached.empty()) {
      const int32_t particle = reached.back();
      reached.pop_back();
      ++size;
      for (const int32_t other : body.neighbours(particle)) {
        const auto o = static_cast<std::size_t>(other);
        if (alive[o] == 0 || pieces.of[o] >= 0) continue;
        pieces.of[o] = piece;
        reached.push_back(other);
      }
    }
    sizes.push_back(size);
  }
  std::vector<int32_t> order(sizes.size()), rank(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    return sizes[static_cast<std::size_t>(a)] > sizes[static_cast<std::size_t>(b)];
  });
  for (std::size_t k = 0; k < order.size(); ++k) rank[static_cast<std::size_t>(order[k])] = static_cast<int32_t>(k);
  for (int32_t& piece : pieces.of) {
    if (piece >= 0) piece = rank[static_cast<std::size_t>(piece)];
  }
  pieces.count = static_cast<int32_t>(sizes.size());
  return pieces;
}

Holders holders_of(const Clusters& clusters, int32_t particles) {
  Holders holders;
  holders.lowest.assign(static_cast<std::size_t>(particles), -1);
  holders.count.assign(static_cast<std::size_t>(particles), 0);
  for (std::size_t k = 0; k + 1 < clusters.offsets.size(); ++k) {
    const std::span<const int32_t> members = extent(clusters, k);
    if (members.empty()) continue;
    const int32_t lowest = *std::min_element(members.begin(), members.end());
    for (const int32_t member : members) {
      if (member < 0 || member >= particles) continue;
      const auto i = static_cast<std::size_t>(member);
      if (holders.lowest[i] < 0) holders.lowest[i] = lowest;
      if (holders.count[i] < 255) ++holders.count[i];
    }
  }
  return holders;
}

std::vector<int32_t> members_of(const Clusters& clusters, int32_t number, int32_t particles) {
  std::vector<int32_t> members;
  for (std::size_t k = 0; k < clusters.number.size(); ++k) {
    if (clusters.number[k] != number) continue;
    for (const int32_t member : extent(clusters, k)) {
      if (member >= 0 && member < particles) members.push_back(member);
    }
  }
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
  return members;
}

}  // namespace cutproof::report
