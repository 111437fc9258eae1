// I2 (method.md §2): each alive particle lies in a cluster, and clusters hold alive particles only.
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_coverage(Judged& judged, Verdict& verdict) {
  std::vector<uint8_t> covered(at(judged.body.particle_count()), 0);
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    const auto members = judged.clusters.of(c);
    const int32_t number = judged.number(c);
    if (members.empty()) violate(verdict, {{number}}, "cluster {} has no particles", number);
    for (std::size_t k = 0; k < members.size(); ++k) {
      const int32_t i = members[k];
      covered[at(i)] = 1;
      if (!judged.alive(i)) {
        violate(verdict, {{number}, {i}}, "cluster {} holds particle {}, which is dead", number, i);
      }
      if (k > 0 && members[k] == members[k - 1]) {
        violate(verdict, {{number}, {i}}, "cluster {} holds particle {} twice", number, i);
      } else if (k > 0 && members[k] < members[k - 1]) {
        violate(verdict, {{number}, {members[k - 1], i}}, "the members of cluster {} do not ascend", number);
      }
    }
  }
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i) && covered[at(i)] == 0) {
      violate(verdict, {{}, {i}}, "particle {} is alive and in no cluster", i);
    }
  }
  for (const auto* list : {&judged.state.removed, &judged.state.debris}) {
    for (const int32_t i : *list) {
      if (judged.alive(i)) violate(verdict, {{}, {i}}, "particle {} was removed but is alive", i);
    }
  }
  verdict.checked = judged.body.particle_count() + static_cast<int64_t>(judged.clusters.members.size());
}

}  // namespace cutproof::oracles
