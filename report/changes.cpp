#include "report/changes.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "model/at.h"
#include "report/pieces.h"

namespace cutproof::report {

namespace {

using Members = std::vector<int32_t>;

// Members of each cluster by its number, ascending. Of two clusters of one number, which no right state has, the first.
std::map<int32_t, Members> clusters_by_number(const Clusters& clusters, int32_t particles) {
  std::map<int32_t, Members> found;
  for (std::size_t place = 0; place < clusters.number.size(); ++place) {
    found.emplace(clusters.number[place], members_at(clusters, place, particles));
  }
  return found;
}

void raise(std::vector<uint8_t>& changes, const Members& particles, Change to) {
  for (const int32_t particle : particles) {
    uint8_t& change = changes[at(particle)];
    change = std::max(change, static_cast<uint8_t>(to));
  }
}

void add_clusters(std::vector<uint8_t>& changes, const Clusters& before, const Clusters& after) {
  if (before.offsets == after.offsets && before.members == after.members && before.number == after.number) return;
  const auto n = static_cast<int32_t>(changes.size());
  const auto old = clusters_by_number(before, n), now = clusters_by_number(after, n);
  std::vector<uint8_t> was_in_one_that_is_gone(changes.size(), 0);
  for (const auto& [number, members] : old) {
    if (now.count(number) != 0) continue;
    for (const int32_t particle : members) was_in_one_that_is_gone[at(particle)] = 1;
  }
  for (const auto& [number, members] : now) {
    const auto was = old.find(number);
    if (was == old.end()) {
      raise(changes, members, Change::reclustered);
      continue;
    }
    Members gained;
    std::set_difference(members.begin(), members.end(), was->second.begin(), was->second.end(),
                        std::back_inserter(gained));
    const bool is_merged = std::any_of(gained.begin(), gained.end(),
                                       [&](int32_t particle) { return was_in_one_that_is_gone[at(particle)] != 0; });
    if (is_merged) {
      raise(changes, members, Change::merged);
    } else if (!gained.empty()) {
      raise(changes, gained, Change::expanded);
    } else if (members.size() < was->second.size()) {
      raise(changes, members, Change::reclustered);
    }
  }
}

void add_skin(std::vector<uint8_t>& changes, const Skin& before, const Skin& after) {
  if (before.owner == after.owner && before.direction == after.direction) return;
  std::set<std::pair<int32_t, int>> old;
  for (std::size_t v = 0; v < std::min(before.owner.size(), before.direction.size()); ++v)
    old.emplace(before.owner[v], before.direction[v]);
  for (std::size_t v = 0; v < std::min(after.owner.size(), after.direction.size()); ++v) {
    const int32_t owner = after.owner[v];
    if (owner < 0 || at(owner) >= changes.size() || old.count({owner, after.direction[v]}) != 0) continue;
    raise(changes, {owner}, Change::skin);
  }
}

}  // namespace

std::vector<uint8_t> changes_between(const State& before, const State& after) {
  std::vector<uint8_t> changes(after.x.size(), static_cast<uint8_t>(Change::nothing));
  if (before.x.size() != after.x.size() || before.alive.size() != after.alive.size()) return changes;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (before.alive[i] != 0 && after.alive[i] == 0) {
      changes[i] = static_cast<uint8_t>(Change::removed);
    } else if (!(before.x[i] == after.x[i])) {
      changes[i] = static_cast<uint8_t>(Change::moved);
    }
  }
  add_clusters(changes, before.clusters, after.clusters);
  add_skin(changes, before.skin, after.skin);
  return changes;
}

}  // namespace cutproof::report
