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
      for (const int32_t other : graph.neighbours(i)) {
        if (held_by[at(other)] != c) isolated[at(c)] = 1;
      }
    }
  }
  return isolated;
}

// Whether cluster c, with these additions, was reached along edges of G within `depth` layers, and whether each
// addition of the first layer was called for.
void check_additions(const Setup& setup, const TissueGraph& graph, const Clusters& before, int32_t c,
                     const std::vector<int32_t>& added, const std::vector<Edge>& uncovered, std::vector<int32_t>& layer,
                     Verdict& verdict) {
  const int32_t number = before.number[at(c)];
  // layer: 0 for old members, k for the k-th layer, -2 for additions not reached yet, -1 for all others.
  for (const int32_t i : before.of(c)) layer[at(i)] = 0;
  for (const int32_t i : added) layer[at(i)] = -2;
  for (const int32_t i : added) {
    if (setup.expand.rule == ExpandRule::published || setup.expand.depth > 1) break;
    bool adjacent = false, called_for = false;
    for (const int32_t other : graph.neighbours(i)) {
      if (layer[at(other)] != 0) continue;
      adjacent = true;
      const Edge edge = {std::min(i, other), std::max(i, other)};
      if (std::binary_search(uncovered.begin(), uncovered.end(), edge)) called_for = true;
    }
    if (!adjacent || called_for) continue;
    violate(verdict, {{number}, {i}},
            "cluster {} took in particle {}, though other clusters held every edge between them already", number, i);
  }
  bool grows = true;
  for (int32_t depth = 1; depth <= setup.expand.depth && grows; ++depth) {
    grows = false;
    for (const int32_t i : added) {
      const auto others = graph.neighbours(i);
      const auto is_before = [&](int32_t other) { return layer[at(other)] == depth - 1; };
      if (layer[at(i)] != -2 || std::none_of(others.begin(), others.end(), is_before)) continue;
      layer[at(i)] = depth;
      grows = true;
    }
  }
  for (const int32_t i : added) {
    if (layer[at(i)] != -2) continue;
    violate(verdict, {{number}, {i}},
            "cluster {} took in particle {}, which no path of at most {} edges through added particles joins to it",
            number, i, setup.expand.depth);
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
    violate(verdict, {{old != a.number.end() ? *old : *now}}, "expansion changed the clusters' numbers");
    return;
  }
  const TissueGraph graph(setup.body, before.alive);
  const bool idle = setup.expand.rule == ExpandRule::none || before.edge_covered;
  const bool published = setup.expand.rule == ExpandRule::published;
  std::optional<UncoveredEdges> open;  // once a cluster has grown
  const std::vector<uint8_t> isolated_before = published ? singly_isolated(graph, a) : std::vector<uint8_t>{};
  std::vector<int32_t> layer(at(graph.particle_count()), -1);

  for (int32_t c = 0; c < a.count(); ++c) {
    const int32_t number = a.number[at(c)];
    const auto old_span = a.of(c), new_span = b.of(c);
    if (std::equal(old_span.begin(), old_span.end(), new_span.begin(), new_span.end())) continue;
    const auto [lost, added] = set_difference(old_span, new_span);
    if (!lost.empty()) {
      violate(verdict, {{number}, {lost.front()}}, "cluster {} lost particle {}", number, lost.front());
      continue;
    }
    if (added.empty()) continue;  // only the order changed: coverage rejects that
    if (idle) {
      violate(verdict, {{number}, {added.front()}}, "cluster {} took in particle {}, but {}", number, added.front(),
              before.edge_covered ? "every edge was covered already" : "the scene expands none");
      continue;
    }
    if (published && isolated_before[at(c)] == 0) {
      violate(verdict, {{number}, {added.front()}},
              "cluster {} took in particle {}, though that cluster was not isolated", number, added.front());
      continue;
    }
    if (!open) open = uncovered_edges(graph, a);
    check_additions(setup, graph, a, c, added, open->uncovered, layer, verdict);
  }

  if (setup.expand.rule == ExpandRule::edge_cover) {
    const UncoveredEdges edges = uncovered_edges(graph, b);
    if (!edges.uncovered.empty()) {
      const auto [a_end, b_end] = edges.uncovered.front();
      violate(verdict, {{}, {a_end, b_end}, {a_end, b_end}},
              "no cluster holds both ends of the edge from particle {} to {}", a_end, b_end);
    } else if (!after.edge_covered) {
      violate(verdict, {}, "every edge is covered, but edge_covered does not say so");
    }
  }
  if (published && !idle) {
    const std::vector<uint8_t> isolated = singly_isolated(graph, b);
    for (int32_t c = 0; c < b.count(); ++c) {
      if (isolated[at(c)] == 0) continue;
      violate(verdict, {{b.number[at(c)]}},
              "cluster {} still shares no particle with another, though edges of the tissue leave it", b.number[at(c)]);
    }
  }
}

}  // namespace cutproof::oracles
