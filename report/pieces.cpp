#include "report/pieces.h"

#include <algorithm>
#include <span>
#include <utility>

#include "model/at.h"
#include "oracles/partitions.h"

namespace cutproof::report {

namespace {

// Members of the k-th cluster, none where its extent lies outside.
std::span<const int32_t> extent(const Clusters& clusters, std::size_t k) {
  if (k + 1 >= clusters.offsets.size()) return {};
  const int64_t first = clusters.offsets[k], end = clusters.offsets[k + 1];
  if (first < 0 || end < first || end > std::ssize(clusters.members)) return {};
  return std::span(clusters.members).subspan(at(first), at(end - first));
}

}  // namespace

Pieces pieces_of(const Body& body, const std::vector<uint8_t>& alive) {
  return pieces_of(oracles::graph_components(body, alive).label);
}

Pieces pieces_of(const std::vector<int32_t>& label) {
  std::vector<int64_t> size(label.size(), 0);
  std::vector<int32_t> order, rank(label.size());  // labels, in the order of their lowest particles
  for (const int32_t one : label) {
    if (one >= 0 && size[at(one)]++ == 0) order.push_back(one);
  }
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) { return size[at(a)] > size[at(b)]; });
  for (std::size_t k = 0; k < order.size(); ++k) rank[at(order[k])] = static_cast<int32_t>(k);
  Pieces pieces = {label, static_cast<int32_t>(order.size())};
  for (int32_t& piece : pieces.of) {
    if (piece >= 0) piece = rank[at(piece)];
  }
  return pieces;
}

Holders holders_of(const Clusters& clusters, int32_t particles) {
  Holders holders;
  holders.lowest.assign(at(particles), -1);
  holders.count.assign(at(particles), 0);
  for (std::size_t k = 0; k + 1 < clusters.offsets.size(); ++k) {
    const std::span<const int32_t> members = extent(clusters, k);
    if (members.empty()) continue;
    const auto is_first = [&](int32_t member) {
      return member >= 0 && member < particles && holders.lowest[at(member)] < 0;
    };
    int32_t lowest = particles;
    for (const int32_t member : members) lowest = is_first(member) ? std::min(lowest, member) : lowest;
    for (const int32_t member : members) {
      if (member < 0 || member >= particles) continue;
      const std::size_t i = at(member);
      if (holders.lowest[i] < 0) holders.lowest[i] = lowest;
      if (holders.count[i] < 255) ++holders.count[i];
    }
  }
  return holders;
}

std::vector<int32_t> coupled_of(const Clusters& clusters, const std::vector<uint8_t>& alive) {
  const auto particles = static_cast<int32_t>(alive.size());
  // Each leads to a lower one of its component, the lowest to itself.
  std::vector<int32_t> lower(alive.size(), -1);
  const auto lowest = [&](int32_t i) {
    while (lower[at(i)] != i) i = lower[at(i)] = lower[at(lower[at(i)])];
    return i;
  };
  for (std::size_t k = 0; k + 1 < clusters.offsets.size(); ++k) {
    int32_t joined = -1;
    for (const int32_t member : extent(clusters, k)) {
      if (member < 0 || member >= particles || alive[at(member)] == 0) continue;
      if (lower[at(member)] < 0) lower[at(member)] = member;
      const int32_t other = lowest(member);
      if (joined >= 0 && joined != other) lower[at(std::max(joined, other))] = std::min(joined, other);
      joined = joined >= 0 ? std::min(joined, other) : other;
    }
  }
  for (int32_t i = 0; i < particles; ++i) {
    if (lower[at(i)] >= 0) lower[at(i)] = lowest(i);
  }
  return lower;
}

namespace {

void add_members(std::vector<int32_t>& members, std::span<const int32_t> given, int32_t particles) {
  for (const int32_t member : given) {
    if (member >= 0 && member < particles) members.push_back(member);
  }
}
std::vector<int32_t> each_once(std::vector<int32_t> members) {
  std::sort(members.begin(), members.end());
  members.erase(std::unique(members.begin(), members.end()), members.end());
  return members;
}

}  // namespace

std::vector<int32_t> members_of(const Clusters& clusters, int32_t number, int32_t particles) {
  std::vector<int32_t> members;
  for (std::size_t k = 0; k < clusters.number.size(); ++k) {
    if (clusters.number[k] == number) add_members(members, extent(clusters, k), particles);
  }
  return each_once(std::move(members));
}

std::vector<int32_t> members_at(const Clusters& clusters, std::size_t place, int32_t particles) {
  std::vector<int32_t> members;
  add_members(members, extent(clusters, place), particles);
  return each_once(std::move(members));
}

}  // namespace cutproof::report
