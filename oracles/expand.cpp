// Expansion (method.md §7): every edge covered, and no cluster grown without need.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// A cluster is isolated by itself if it shares no particle with another while edges of G leave it (method.md §7,
// published). [m] 1 for those.
std::vector<uint8_t> singly_isolated(const TissueGraph& graph, const Clusters& clusters) {
  const std::vector<int32_t> memberships = membership_counts(clusters, graph.particle_count());
  std::vector<int32_t> held_by(at(graph.particle_count()), -1);
  std::vector<uint8_t> isolated(at(clusters.count()), 0);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    if (std::any_of(members.begin(), members.end(), [&](int32_t i) { return memberships[at(i)] > 1; })) continue;
    for (const int32_t i : members) held_by[at(i)] = c;
    for (const int32_t i : members) {
      for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
        const int32_t other = graph.neighbour(i, direction);
        if (other >= 0 && held_by[at(other)] != c) isolated[at(c)] = 1;
      }
    }
  }
  return isolated;
}

// Whether cluster c, with these additions, was reached along edges of G within `depth` layers, and whether each
// addition of the first layer was called for.
void check_additions(const Setup& setup, const TissueGraph& graph, const Clusters& before, int32_t c,
                     const std::vector<int32_t>& added, const std::vector<uint8_t>& covered,
                     std::vector<int32_t>& layer, Verdict& verdict) {
  const int32_t number = before.number[at(c)];
  // layer: 0 for old members, k for the k-th layer, -2 for additions not reached yet, -1 for all others.
  for (const int32_t i : before.of(c)) layer[at(i)] = 0;
  std::vector<int32_t> front;
  for (const int32_t i : added) layer[at(i)] = -2;
  for (const int32_t i : added) {
    bool adjacent = false, called_for = setup.expand.rule == ExpandRule::published;
    for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
      const int32_t other = graph.neighbour(i, direction);
      if (other < 0 || layer[at(other)] != 0) continue;
      adjacent = true;
      const int32_t low = direction % 2 == 0 ? i : other;  // the end from which the edge leaves in + direction
      if (covered[at(low) * 3 + at(direction / 2)] == 0) called_for = true;
    }
    if (!adjacent) continue;
    front.push_back(i);
    if (!called_for && setup.expand.depth <= 1) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, though other clusters held every "
                          "edge between them already",
                          number, i),
              {number}, {i});
    }
  }
  for (const int32_t i : front) layer[at(i)] = 1;
  for (int32_t depth = 2; depth <= setup.expand.depth && !front.empty(); ++depth) {
    std::vector<int32_t> next;
    for (const int32_t i : front) {
      for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
        const int32_t other = graph.neighbour(i, direction);
        if (other < 0 || layer[at(other)] != -2) continue;
        layer[at(other)] = depth;
        next.push_back(other);
      }
    }
    front = std::move(next);
  }
  for (const int32_t i : added) {
    if (layer[at(i)] == -2) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, which no path of at most {} "
                          "edges through added particles joins to it",
                          number, i, setup.expand.depth),
              {number}, {i});
    }
  }
  for (const int32_t i : before.of(c)) layer[at(i)] = -1;
  for (const int32_t i : added) layer[at(i)] = -1;
}

}  // namespace

void check_expansion(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  const Clusters &a = before.clusters, &b = after.clusters;
  verdict.checked = a.count();
  if (a.number != b.number) {
    const auto [old, now] = std::mismatch(a.number.begin(), a.number.end(), b.number.begin(), b.number.end());
    violate(verdict, "expansion changed the clusters' numbers", {old != a.number.end() ? *old : *now});
    return;
  }
  const TissueGraph graph(setup.body, before.alive);
  const bool idle = setup.expand.rule == ExpandRule::none || before.edge_covered;
  const bool published = setup.expand.rule == ExpandRule::published;
  std::optional<std::vector<uint8_t>> covered;  // once a cluster has grown
  const std::vector<uint8_t> isolated_before = published ? singly_isolated(graph, a) : std::vector<uint8_t>{};
  std::vector<int32_t> layer(at(graph.particle_count()), -1);
  std::vector<int32_t> old_members, new_members, added, lost;
  for (int32_t c = 0; c < a.count(); ++c) {
    const int32_t number = a.number[at(c)];
    const auto old_span = a.of(c), new_span = b.of(c);
    if (std::equal(old_span.begin(), old_span.end(), new_span.begin(), new_span.end())) continue;
    old_members.assign(old_span.begin(), old_span.end());
    new_members.assign(new_span.begin(), new_span.end());
    std::sort(old_members.begin(), old_members.end());
    std::sort(new_members.begin(), new_members.end());
    added.clear();
    lost.clear();
    std::set_difference(new_members.begin(), new_members.end(), old_members.begin(), old_members.end(),
                        std::back_inserter(added));
    std::set_difference(old_members.begin(), old_members.end(), new_members.begin(), new_members.end(),
                        std::back_inserter(lost));
    if (!lost.empty()) {
      violate(verdict, fmt::format("cluster {} lost particle {}", number, lost.front()), {number}, {lost.front()});
      continue;
    }
    if (added.empty()) continue;  // only the order changed: coverage rejects that
    if (idle) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, but {}", number, added.front(),
                          before.edge_covered ? "every edge was covered already" : "the scene expands none"),
              {number}, {added.front()});
      continue;
    }
    if (published && isolated_before[at(c)] == 0) {
      violate(verdict, fmt::format("cluster {} took in particle {}, but it was not isolated", number, added.front()),
              {number}, {added.front()});
      continue;
    }
    if (!covered) covered = covered_edges(graph, a);
    check_additions(setup, graph, a, c, added, *covered, layer, verdict);
  }

  if (setup.expand.rule == ExpandRule::edge_cover) {
    const UncoveredEdges edges = uncovered_edges(graph, b);
    if (edges.uncovered > 0) {
      violate(verdict, fmt::format("no cluster holds both ends of the edge from particle {} to {}", edges.a, edges.b),
              {}, {edges.a, edges.b}, {edges.a, edges.b});
    } else if (!after.edge_covered) {
      violate(verdict, "every edge is covered, but edge_covered does not say so");
    }
  }
  if (published && !idle) {
    const std::vector<uint8_t> isolated = singly_isolated(graph, b);
    for (int32_t c = 0; c < b.count(); ++c) {
      if (isolated[at(c)] == 0) continue;
      violate(verdict,
              fmt::format("cluster {} still shares no particle with another, though edges of the tissue leave "
                          "it",
                          b.number[at(c)]),
              {b.number[at(c)]});
    }
  }
}

}  // namespace cutproof::oracles
