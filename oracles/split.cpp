// Split (method.md §5): exactly the components of the rest of each cluster.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>

#include "oracles/checks.h"
#include "oracles/rotation_change.h"

namespace cutproof::oracles {
namespace {

// The result of a split, from the definition.
struct ExpectedCluster {
  int64_t number = 0;  // may leave the range of numbers, and then no cluster can have it
  int32_t parent = 0;  // index of the cluster it comes from
  bool lost = false;   // whether that one lost a particle
  std::vector<int32_t> members;
};

// The living members of a cluster, ascending.
std::vector<int32_t> left_of(const TissueGraph& graph, std::span<const int32_t> members) {
  std::set<int32_t> left;
  for (const int32_t i : members) {
    if (graph.alive(i)) left.insert(i);
  }
  return {left.begin(), left.end()};
}

// Its components, in the order of their smallest particles. `mark` [n] is scratch, -1 wherever it is not in use.
std::vector<std::vector<int32_t>> components_within(const TissueGraph& graph, const std::vector<int32_t>& left,
                                                    std::vector<int32_t>& mark) {
  DisjointSets sets(static_cast<int64_t>(left.size()));
  for (std::size_t k = 0; k < left.size(); ++k) mark[at(left[k])] = static_cast<int32_t>(k);
  for (std::size_t k = 0; k < left.size(); ++k) {
    for (const int32_t other : graph.upper_neighbours(left[k])) {
      if (mark[at(other)] >= 0) sets.unite(static_cast<int32_t>(k), mark[at(other)]);
    }
  }
  for (const int32_t i : left) mark[at(i)] = -1;
  std::map<int32_t, std::vector<int32_t>> by_root;  // the root is the smallest of its set
  for (std::size_t k = 0; k < left.size(); ++k) by_root[sets.find(static_cast<int32_t>(k))].push_back(left[k]);
  std::vector<std::vector<int32_t>> components;
  for (auto& [root, component] : by_root) components.push_back(std::move(component));
  return components;
}

std::vector<ExpectedCluster> expected_split(const TissueGraph& graph, const Clusters& before) {
  std::vector<ExpectedCluster> expected, separated;
  std::vector<int32_t> mark(at(graph.particle_count()), -1);
  for (int32_t c = 0; c < before.count(); ++c) {
    const auto members = before.of(c);
    const bool lost = std::any_of(members.begin(), members.end(), [&](int32_t i) { return !graph.alive(i); });
    if (!lost) {
      expected.push_back({before.number[at(c)], c, false, {members.begin(), members.end()}});
      continue;
    }
    auto components = components_within(graph, left_of(graph, members), mark);
    for (std::size_t k = 0; k < components.size(); ++k) {
      (k == 0 ? expected : separated).push_back({before.number[at(c)], c, true, std::move(components[k])});
    }
  }
  int64_t next = before.count() == 0 ? 0 : int64_t{before.number.back()} + 1;
  for (ExpectedCluster& cluster : separated) {
    cluster.number = next++;
    expected.push_back(std::move(cluster));
  }
  return expected;
}

// Why a cluster is not the one expected under its number. `left`: the rest of the old cluster.
void tell_difference(Verdict& verdict, int32_t number, const std::vector<int32_t>& expected,
                     std::span<const int32_t> found, const std::vector<int32_t>& left) {
  if (expected.empty()) return violate(verdict, {{number}}, "cluster {} was empty and is not", number);
  const auto [missing, surplus] = set_difference(expected, found);
  const int32_t home = expected.front();
  if (!surplus.empty()) {
    const int32_t i = surplus.front();
    if (std::find(left.begin(), left.end(), i) == left.end()) {
      return violate(verdict, {{number}, {i}}, "cluster {} holds particle {}, which does not belong to it", number, i);
    }
    return violate(
        verdict, {{number}, {home, i}},
        "cluster {} holds particles {} and {}, which lie in different components of what is left of the old cluster",
        number, home, i);
  }
  if (!missing.empty()) {
    return violate(verdict, {{number}, {missing.front(), home}},
                   "cluster {} lacks particle {}, which is connected to its particle {} within the old cluster", number,
                   missing.front(), home);
  }
  violate(verdict, {{number}}, "the members of cluster {} are not in ascending order", number);
}

void check_debris(const Setup& setup, const State& before, const State& after, Verdict& verdict) {
  std::vector<int32_t> debris;
  const TissueGraph graph(setup.body, before.alive);
  const int32_t n = graph.particle_count();
  if (setup.split.debris > 0) {
    const Partition components = components_of_graph(graph);
    std::vector<int32_t> size(at(components.count), 0);
    for (const int32_t label : components.label) {
      if (label >= 0) ++size[at(label)];
    }
    for (int32_t i = 0; i < n; ++i) {
      if (graph.alive(i) && size[at(components.label[at(i)])] < setup.split.debris) debris.push_back(i);
    }
  }
  if (const auto wrong = first_in_one_only(debris, after.debris)) {
    violate(verdict, {{}, {wrong->element}},
            "particle {} {} listed as debris; debris are the components of fewer than {} particles", wrong->element,
            wrong->in_second ? "must not be" : "must be", setup.split.debris);
  }
  for (int32_t i = 0; i < n; ++i) {
    const bool expected = graph.alive(i) && !std::binary_search(debris.begin(), debris.end(), i);
    if (expected == (after.alive[at(i)] != 0)) continue;
    violate(verdict, {{}, {i}}, "particle {} should be {} after the split", i, expected ? "alive" : "dead");
  }
}

}  // namespace

void check_split_exactness(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  check_debris(setup, before, after, verdict);
  verdict.checked = before.clusters.count();
  // From the particles that are alive after the stage; if those are wrong, the witness says so already.
  const TissueGraph graph(setup.body, after.alive);
  const std::vector<ExpectedCluster> expected = expected_split(graph, before.clusters);
  const Clusters& found = after.clusters;
  // A missing cluster: its origin, and the cluster found instead.
  const auto tell_missing = [&](const ExpectedCluster& cluster) {
    const auto number = static_cast<int32_t>(cluster.number);
    const int32_t parent = before.clusters.number[at(cluster.parent)];
    const std::vector<int32_t>& members = cluster.members;
    if (members.empty()) return violate(verdict, {{number}}, "cluster {} is missing, which was empty before", number);
    const std::string piece = members.size() == 1
                                  ? fmt::format("1 particle ({})", members.front())
                                  : fmt::format("{} particles (the smallest {})", members.size(), members.front());
    if (cluster.number == parent) {
      return violate(verdict, {{number}, {members.front()}}, "cluster {} is missing{} {}", number,
                     cluster.lost ? ": it should have kept the first piece of what is left of it,"
                                  : ", though it lost nothing: it has",
                     piece);
    }
    std::string instead = "has become no cluster";
    for (int32_t c = 0; c < found.count(); ++c) {
      const auto held = found.of(c);
      if (std::equal(members.begin(), members.end(), held.begin(), held.end()))
        instead = fmt::format("is cluster {}, where it should be cluster {}", found.number[at(c)], cluster.number);
    }
    violate(verdict, {{number, parent}, {members.front()}}, "cluster {} fell apart, and its piece of {} {}", parent,
            piece, instead);
  };
  // The first of its members, if it has any.
  const auto first_of = [](std::span<const int32_t> members) {
    return std::vector<int32_t>(members.begin(), members.begin() + (members.empty() ? 0 : 1));
  };
  // Both are in the order of numbers, so walk along both.
  std::size_t e = 0;
  int32_t f = 0;
  while (e < expected.size() || f < found.count()) {
    if (f >= found.count() || (e < expected.size() && expected[e].number < found.number[at(f)])) {
      tell_missing(expected[e++]);
      continue;
    }
    const int32_t number = found.number[at(f)];
    const auto members = found.of(f);
    if (e >= expected.size() || number < expected[e].number) {
      violate(verdict, {{number}, first_of(members)}, "cluster {} comes from nowhere", number);
      ++f;
      continue;
    }
    const ExpectedCluster& cluster = expected[e];
    if (!std::equal(members.begin(), members.end(), cluster.members.begin(), cluster.members.end())) {
      tell_difference(verdict, number, cluster.members, members, left_of(graph, before.clusters.of(cluster.parent)));
    } else if (!same_bits(found.rotation[at(f)], before.clusters.rotation[at(cluster.parent)]) ||
               found.degenerate[at(f)] != before.clusters.degenerate[at(cluster.parent)]) {
      violate(verdict, {{number}}, "cluster {} did not inherit the rotation of cluster {}: {}", number,
              before.clusters.number[at(cluster.parent)], rotation_change(before.clusters, cluster.parent, found, f));
    }
    ++e;
    ++f;
  }
}

}  // namespace cutproof::oracles
