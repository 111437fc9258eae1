// I4 (method.md §2): each edge of G lies in a cluster.
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_edge_cover(Judged& judged, Verdict& verdict) {
  if (!judged.state.edge_covered) {
    verdict.vacuous = "the state does not promise it";
    return;
  }
  const UncoveredEdges edges = uncovered_edges(judged.graph, judged.clusters);
  verdict.checked = edges.edges;
  verdict.measured = static_cast<double>(edges.uncovered.size());
  if (edges.uncovered.empty()) return;
  const auto [a, b] = edges.uncovered.front();
  fail(verdict, {{}, {a, b}, {a, b}}, "no cluster holds both ends of the edge from particle {} to {}", a, b);
}

}  // namespace cutproof::oracles
