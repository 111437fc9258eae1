// Split (method.md §5): exactly the components of what is left of each cluster.
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// What must come out of a split, found from the definition.
struct ExpectedCluster {
  int64_t number = 0;  // may leave the range of numbers, and then no cluster can have it
  int32_t parent = 0;  // index of the cluster it comes from
  bool lost = false;   // whether that one lost a particle
  std::vector<int32_t> members;
};

// The components of what is left alive of one cluster, in the order of their smallest particles. `mark` [n] is
// scratch, -1 wherever it is not in use.
std::vector<std::vector<int32_t>> components_within(const TissueGraph& graph, std::span<const int32_t> members,
                                                    std::vector<int32_t>& mark) {
  std::vector<int32_t> left;
  for (const int32_t i : members) {
    if (graph.alive(i)) left.push_back(i);
  }
  std::sort(left.begin(), left.end());
  left.erase(std::unique(left.begin(), left.end()), left.end());
  DisjointSets sets(static_cast<int64_t>(left.size()));
  for (std::size_t k = 0; k < left.size(); ++k) mark[at(left[k])] = static_cast<int32_t>(k);
  for (std::size_t k = 0; k < left.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t other = graph.neighbour(left[k], 2 * axis);
      if (other >= 0 && mark[at(other)] >= 0) sets.unite(static_cast<int32_t>(k), mark[at(other)]);
    }
  }
  for (const int32_t i : left) mark[at(i)] = -1;
  std::vector<std::vector<int32_t>> components;
  std::vector<std::size_t> component_of(left.size());
  for (std::size_t k = 0; k < left.size(); ++k) {
    const auto root = at(sets.find(static_cast<int32_t>(k)));
    if (root == k) {
      component_of[k] = components.size();
      components.emplace_back();
    } else {
      component_of[k] = component_of[root];
    }
    components[component_of[k]].push_back(left[k]);
  }
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
    auto components = components_within(graph, members, mark);
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

// Why a cluster is not the one that was expected under its number.
Witness difference_of_sets(int32_t number, const std::vector<int32_t>& expected, std::span<const int32_t> found,
                           const std::vector<int32_t>& component_of_parent) {
  std::vector<int32_t> sorted(found.begin(), found.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<int32_t> surplus, missing;
  std::set_difference(sorted.begin(), sorted.end(), expected.begin(), expected.end(), std::back_inserter(surplus));
  std::set_difference(expected.begin(), expected.end(), sorted.begin(), sorted.end(), std::back_inserter(missing));
  if (!surplus.empty()) {
    const int32_t i = surplus.front(), home = expected.front();
    if (component_of_parent[at(i)] >= 0) {
      return {{number},
              {home, i},
              {},
              fmt::format("cluster {} holds particles {} and {}, which lie in different components of what is left of "
                          "the old cluster",
                          number, home, i)};
    }
    return {{number}, {i}, {}, fmt::format("cluster {} holds particle {}, which does not belong to it", number, i)};
  }
  if (!missing.empty()) {
    return {{number},
            {missing.front(), expected.front()},
            {},
            fmt::format("cluster {} lacks particle {}, which is connected to its particle {} within the old cluster",
                        number, missing.front(), expected.front())};
  }
  return {{number}, {}, {}, fmt::format("the members of cluster {} are not in ascending order", number)};
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
  if (debris != after.debris) {
    const auto [mine, listed] = std::mismatch(debris.begin(), debris.end(), after.debris.begin(), after.debris.end());
    const bool lists_more = mine == debris.end() || (listed != after.debris.end() && *listed < *mine);
    const int32_t first = lists_more ? *listed : *mine;
    violate(verdict,
            fmt::format("particle {} {} listed as debris; debris are the components of fewer than {} particles", first,
                        lists_more ? "must not be" : "must be", setup.split.debris),
            {}, {first});
  }
  std::size_t next = 0;
  for (int32_t i = 0; i < n; ++i) {
    while (next < debris.size() && debris[next] < i) ++next;
    const bool vanishes = next < debris.size() && debris[next] == i;
    const bool expected = before.alive[at(i)] != 0 && !vanishes;
    if (expected == (after.alive[at(i)] != 0)) continue;
    violate(verdict, fmt::format("particle {} should be {} after the split", i, expected ? "alive" : "dead"), {}, {i});
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
  std::vector<int32_t> component_of_parent(at(graph.particle_count()), -1);

  // Both are in the order of numbers, so walk along both.
  std::size_t e = 0;
  int32_t f = 0;
  while (e < expected.size() || f < found.count()) {
    const bool missing = f >= found.count() || (e < expected.size() && expected[e].number < found.number[at(f)]);
    if (missing) {
      const ExpectedCluster& cluster = expected[e++];
      std::vector<int32_t> first;
      if (!cluster.members.empty()) first.push_back(cluster.members.front());
      violate(
          verdict,
          fmt::format("cluster {} is missing: it holds {} particles{}, {} of cluster {}", cluster.number,
                      cluster.members.size(),
                      cluster.members.empty() ? "" : fmt::format(", the smallest {}", cluster.members.front()),
                      cluster.lost ? "a component of what is left" : "all", before.clusters.number[at(cluster.parent)]),
          {static_cast<int32_t>(cluster.number)}, first);
      continue;
    }
    const int32_t number = found.number[at(f)];
    const auto members = found.of(f);
    if (e >= expected.size() || number < expected[e].number) {
      std::vector<int32_t> particles;
      if (!members.empty()) particles.push_back(members.front());
      violate(verdict, fmt::format("cluster {} comes from nowhere", number), {number}, particles);
      ++f;
      continue;
    }
    const ExpectedCluster& cluster = expected[e];
    if (!std::equal(members.begin(), members.end(), cluster.members.begin(), cluster.members.end())) {
      Witness witness;
      if (verdict.holds) {
        for (const int32_t i : before.clusters.of(cluster.parent)) {
          if (graph.alive(i)) component_of_parent[at(i)] = cluster.parent;
        }
        witness = cluster.members.empty()
                      ? Witness{{number}, {}, {}, fmt::format("cluster {} was empty and is not", number)}
                      : difference_of_sets(number, cluster.members, members, component_of_parent);
      }
      violate(verdict, witness);
    } else if (!same_bits(found.rotation[at(f)], before.clusters.rotation[at(cluster.parent)]) ||
               found.degenerate[at(f)] != before.clusters.degenerate[at(cluster.parent)]) {
      violate(verdict,
              fmt::format("cluster {} did not inherit the rotation of cluster {}", number,
                          before.clusters.number[at(cluster.parent)]),
              {number});
    }
    ++e;
    ++f;
  }
}

}  // namespace cutproof::oracles
