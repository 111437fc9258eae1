// I3 (method.md §2): no group of clusters is isolated within connected tissue.
#include <fmt/format.h>

#include <algorithm>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_isolation(Judged& judged, Verdict& verdict) {
  const Partition& coupling = judged.coupling();
  verdict.checked = coupling.count;
  verdict.measured = static_cast<double>(judged.coupled_components() - judged.components().count);
  verdict.holds = verdict.measured == 0;
  if (verdict.holds) return;

  // The smaller of the two groups that meet at an edge without coupling.
  Edge edge = judged.first_uncoupled_edge();
  const auto group_size = [&](int32_t particle) {
    return std::count(coupling.label.begin(), coupling.label.end(), coupling.label[at(particle)]);
  };
  if (group_size(edge.b) < group_size(edge.a)) std::swap(edge.a, edge.b);
  const int32_t group = coupling.label[at(edge.a)];
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i)) continue;
      if (coupling.label[at(i)] == group) verdict.witness.clusters.push_back(judged.number(c));
      break;
    }
  }
  verdict.witness.particles = {edge.a, edge.b};
  verdict.witness.path = {edge.a, edge.b};
  verdict.witness.text = fmt::format(
      "{} of {} clusters form a group of {} particles that shares no particle with any other cluster, though particle "
      "{} of it is a neighbour of particle {}",
      verdict.witness.clusters.size(), judged.clusters.count(), group_size(edge.a), edge.a, edge.b);
}

}  // namespace cutproof::oracles
