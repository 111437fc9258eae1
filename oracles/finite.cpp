// No number of a state is NaN or infinite.
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_finite(Judged& judged, Verdict& verdict) {
  const auto look = [&](bool finite, std::vector<int32_t> Concerned::*kind, int32_t name, const char* what) {
    ++verdict.checked;
    if (finite) return;
    Concerned concerned;
    concerned.*kind = {name};
    violate(verdict, concerned, "the {} {} is not finite", what, name);
  };
  const State& state = judged.state;
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    look(is_finite(state.x[at(i)]), &Concerned::particles, i, "position of particle");
    look(is_finite(state.v[at(i)]), &Concerned::particles, i, "velocity of particle");
  }
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    const int32_t number = judged.number(c);
    const auto& entries = judged.clusters.rotation[at(c)].m;
    look(std::all_of(entries.begin(), entries.end(), [](double entry) { return std::isfinite(entry); }),
         &Concerned::clusters, number, "rotation of cluster");
    look(is_finite(judged.clusters.rest_center[at(c)]), &Concerned::clusters, number, "rest center of cluster");
    look(std::isfinite(judged.clusters.mass[at(c)]), &Concerned::clusters, number, "mass of cluster");
  }
  for (std::size_t v = 0; v < state.skin.position.size(); ++v) {
    ++verdict.checked;
    if (is_finite(state.skin.position[v])) continue;
    violate(verdict, {{}, {state.skin.owner[v]}}, "the position of skin vertex {} is not finite", v);
  }
  ++verdict.checked;
  if (!is_finite(state.impulse)) violate(verdict, {}, "the impulse is not finite");
}

}  // namespace cutproof::oracles
