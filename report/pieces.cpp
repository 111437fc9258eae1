#include "report/pieces.h"

#include <algorithm>
#include <numeric>
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
  const oracles::Partition components = oracles::graph_components(body, alive);
  std::vector<int64_t> size(at(components.count), 0);
  for (const int32_t label : components.label) {
    if (label >= 0) ++size[at(label)];
  }
  std::vector<int32_t> order(size.size()), rank(size.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) { return size[at(a)] > size[at(b)]; });
  for (std::size_t k = 0; k < order.size(); ++k) rank[at(order[k])] = static_cast<int32_t>(k);
  Pieces pieces = {components.label, components.count};
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
