// Only cut tissue is removed: every dead particle is listed as removed.
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_tissue_kept(Judged& judged, Verdict& verdict) {
  std::vector<uint8_t> listed(at(judged.body.particle_count()), 0);
  for (const auto* list : {&judged.state.removed, &judged.state.debris}) {
    for (const int32_t i : *list) listed[at(i)] = 1;
  }
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i)) continue;
    ++verdict.checked;
    if (listed[at(i)] == 0) violate(verdict, {{}, {i}}, "particle {} is dead, and no cut has removed it", i);
  }
}

}  // namespace cutproof::oracles
