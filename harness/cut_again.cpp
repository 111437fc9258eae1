#include "harness/cut_again.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>

#include "model/at.h"
#include "model/fields.h"
#include "model/rules.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

using oracles::RotationKnown;

namespace {

bool same_clusters(const Clusters& a, const Clusters& b) {
  return a.offsets == b.offsets && a.members == b.members && a.number == b.number;
}

// [split.clusters] of each piece the clusters of `end` that contain it.
std::vector<std::vector<int32_t>> containers_of(const Clusters& split, const Clusters& end, std::size_t particles) {
  std::vector<std::vector<int32_t>> holders(particles);
  for (int32_t c = 0; c < end.count(); ++c) {
    for (const int32_t i : end.of(c)) holders[at(i)].push_back(c);
  }
  std::vector<std::vector<int32_t>> containers(at(split.count()));
  std::vector<int64_t> shared(at(end.count()), 0);
  for (int32_t s = 0; s < split.count(); ++s) {
    for (const int32_t i : split.of(s)) {
      for (const int32_t c : holders[at(i)]) {
        if (++shared[at(c)] == split.size(s)) containers[at(s)].push_back(c);
      }
    }
    for (const int32_t i : split.of(s)) {
      for (const int32_t c : holders[at(i)]) shared[at(c)] = 0;
    }
  }
  return containers;
}

Origins by_number(const CutAgain& split, const Clusters& end) {
  Origins origins;
  const std::vector<int32_t>& numbers = split.state.clusters.number;
  for (const int32_t number : end.number) {
    std::vector<int32_t>& from = origins.emplace_back();
    const auto place = std::lower_bound(numbers.begin(), numbers.end(), number);
    if (place != numbers.end() && *place == number) from = {split.origin[at(place - numbers.begin())]};
  }
  return origins;
}

// Clusters are in the order of their numbers, and each has that of one of its candidates: leaves out what would not
// ascend. Where nothing ascends, none is left out.
void keep_ascending(std::vector<std::vector<int32_t>>& candidates) {
  std::vector<int32_t> least, greatest(candidates.size());
  int32_t bound = -1;
  for (const std::vector<int32_t>& of_one : candidates) {
    const auto next = std::upper_bound(of_one.begin(), of_one.end(), bound);
    if (next == of_one.end()) return;
    least.push_back(bound = *next);
  }
  bound = std::numeric_limits<int32_t>::max();
  for (std::size_t c = candidates.size(); c-- > 0;) {
    const auto end = std::lower_bound(candidates[c].begin(), candidates[c].end(), bound);
    if (end == candidates[c].begin()) return;
    greatest[c] = bound = *std::prev(end);
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    std::erase_if(candidates[c], [&](int32_t s) { return s < least[c] || s > greatest[c]; });
  }
}

Origins by_containment(const CutAgain& split, const State& end) {
  const Clusters& pieces = split.state.clusters;
  const auto containers = containers_of(pieces, end.clusters, end.x.size());
  std::vector<std::vector<int32_t>> contained(at(end.clusters.count()));
  for (int32_t s = 0; s < pieces.count(); ++s) {
    for (const int32_t c : containers[at(s)]) contained[at(c)].push_back(s);
  }
  for (std::vector<int32_t>& candidates : contained) {
    std::vector<int32_t> stays;
    for (const int32_t s : candidates) {
      if (pieces.size(s) >= end.tau && containers[at(s)].size() == 1) stays.push_back(s);
    }
    if (stays.size() == 1) candidates = stays;
  }
  keep_ascending(contained);
  Origins origins;
  for (const std::vector<int32_t>& candidates : contained) {
    std::vector<int32_t>& from = origins.emplace_back();
    for (const int32_t s : candidates) from.push_back(split.origin[at(s)]);
    std::sort(from.begin(), from.end());
    from.erase(std::unique(from.begin(), from.end()), from.end());
  }
  return origins;
}

}  // namespace

CutAgain cut_again(const Setup& setup, const State& detected, Stage last) {
  // No stage from split to expand reads a rotation, they only hand it on: so it can carry a name.
  State named = detected;
  for (int32_t c = 0; c < named.clusters.count(); ++c) named.clusters.rotation[at(c)].m[0] = c;
  const std::unique_ptr<Backend> reference = reference::make_backend();
  reference->load({setup}, {std::move(named)});
  reference->run({Stage::split, std::min(last, Stage::expand)});
  CutAgain again{reference->snapshot().front(), {}};
  for (Mat3& rotation : again.state.clusters.rotation) {
    again.origin.push_back(static_cast<int32_t>(rotation.m[0]));
    rotation = detected.clusters.rotation[at(again.origin.back())];
  }
  if (last == Stage::skin) {
    reference->load({setup}, {std::move(again.state)});
    reference->run({Stage::skin, Stage::skin});
    again.state = reference->snapshot().front();
  }
  return again;
}

Origins origins_of(const Setup& setup, const State& detected, Stage last, const CutAgain& expected, const State& end) {
  if (promise_of(setup.merge.rule).unique || last == Stage::split) {
    Origins origins(at(end.clusters.count()));
    if (!same_clusters(expected.state.clusters, end.clusters)) return origins;
    for (std::size_t c = 0; c < origins.size(); ++c) origins[c] = {expected.origin[c]};
    return origins;
  }
  const CutAgain split = cut_again(setup, detected, Stage::split);
  return last < Stage::skin ? by_number(split, end.clusters) : by_containment(split, end);
}

std::vector<RotationKnown> hand_back(const Origins& origins, const Clusters& end, Clusters& before) {
  std::vector<RotationKnown> known(at(before.count()), RotationKnown::gone);
  for (std::size_t c = 0; c < origins.size(); ++c) {
    if (origins[c].size() != 1) continue;
    const std::size_t from = at(origins[c].front());
    if (known[from] == RotationKnown::yes) continue;
    known[from] = RotationKnown::yes;
    before.rotation[from] = end.rotation[c];
    before.degenerate[from] = end.degenerate[c];
  }
  // One of several is shown, and it is not known which.
  for (const std::vector<int32_t>& from : origins) {
    if (from.size() < 2) continue;
    const auto one =
        std::find_if(from.begin(), from.end(), [&](int32_t c) { return known[at(c)] == RotationKnown::gone; });
    if (one != from.end()) known[at(*one)] = RotationKnown::no;
  }
  return known;
}

int32_t first_that_inherits_otherwise(const Origins& origins, const Clusters& before,
                                      const std::vector<RotationKnown>& known, const Clusters& end) {
  const auto may_come_from = [&](std::size_t c, int32_t from) {
    const bool is_known = known.empty() || known[at(from)] == RotationKnown::yes;
    return !is_known ||
           (same_bits(end.rotation[c], before.rotation[at(from)]) && end.degenerate[c] == before.degenerate[at(from)]);
  };
  for (std::size_t c = 0; c < origins.size(); ++c) {
    if (origins[c].empty()) continue;
    const bool any =
        std::any_of(origins[c].begin(), origins[c].end(), [&](int32_t from) { return may_come_from(c, from); });
    if (!any) return static_cast<int32_t>(c);
  }
  return -1;
}

}  // namespace cutproof::harness
