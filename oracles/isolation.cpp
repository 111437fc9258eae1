// I3 (method.md §2): no group of clusters is isolated within connected tissue.
#include <fmt/format.h>

#include <algorithm>

#include "model/counted.h"
#include "oracles/checks.h"

namespace cutproof::oracles {

void check_isolation(Judged& judged, Verdict& verdict) {
  const Partition& coupling = judged.coupling();
  verdict.checked = coupling.count;
  verdict.measured = static_cast<double>(judged.coupled_components() - judged.components().count);
  if (verdict.measured == 0) return;

  // The smaller of the two groups that meet at an edge without coupling.
  Edge edge = judged.first_uncoupled_edge();
  const auto group_size = [&](int32_t particle) {
    return std::count(coupling.label.begin(), coupling.label.end(), coupling.label[at(particle)]);
  };
  if (group_size(edge.b) < group_size(edge.a)) std::swap(edge.a, edge.b);
  std::vector<int32_t> group;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i)) continue;
      if (coupling.label[at(i)] == coupling.label[at(edge.a)]) group.push_back(judged.number(c));
      break;
    }
  }
  const Concerned concerned = {group, {edge.a, edge.b}, {edge.a, edge.b}};
  if (group.empty())
    return fail(verdict, concerned, "particle {} lies in no cluster, though it is a neighbour of particle {}", edge.a,
                edge.b);
  fail(verdict, concerned,
       "{} of {} clusters {} a group of {} that shares no particle with any other cluster, though particle "
       "{} of it is a neighbour of particle {}",
       group.size(), judged.clusters.count(), group.size() == 1 ? "is" : "form",
       counted(group_size(edge.a), "particle", "particles"), edge.a, edge.b);
}

}  // namespace cutproof::oracles
