// No number of a state is NaN or infinite.
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {

void check_finite(Judged& judged, Verdict& verdict) {
  const auto look = [&](bool finite, std::vector<int32_t> Witness::*kind, int32_t name, const char* what) {
    ++verdict.checked;
    if (finite) return;
    Witness witness;
    witness.text = fmt::format("{} is not finite", what);
    if (kind != nullptr) witness.*kind = {name};
    violate(verdict, std::move(witness));
  };
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    look(is_finite(judged.state.x[at(i)]), &Witness::particles, i, "a position");
    look(is_finite(judged.state.v[at(i)]), &Witness::particles, i, "a velocity");
  }
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    bool rotation = true;
    for (const double entry : judged.clusters.rotation[at(c)].m) rotation = rotation && std::isfinite(entry);
    const int32_t number = judged.number(c);
    look(rotation, &Witness::clusters, number, "a cluster's rotation");
    look(is_finite(judged.clusters.rest_center[at(c)]), &Witness::clusters, number, "a cluster's rest center");
    look(std::isfinite(judged.clusters.mass[at(c)]), &Witness::clusters, number, "a cluster's mass");
  }
  const Skin& skin = judged.state.skin;
  for (std::size_t v = 0; v < skin.position.size(); ++v) {
    ++verdict.checked;
    if (is_finite(skin.position[v])) continue;
    violate(verdict, fmt::format("the position of skin vertex {} is not finite", v), {}, {skin.owner[v]});
  }
  look(is_finite(judged.state.impulse), nullptr, 0, "the impulse");
}

}  // namespace cutproof::oracles
