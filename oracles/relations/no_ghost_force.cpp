// Tissue that is not connected feels nothing of each other.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

namespace {

// A piece below the size of debris that exists from the beginning is removed with the first removal anywhere. A kick
// that tears tissue would remove it without a force (decisions.md, A kick drops no debris).
Setup without_debris(Setup setup) {
  setup.split.debris = 0;
  return setup;
}

}  // namespace

Verdict no_ghost_force(Backend& backend, const Setup& given, const State& state, int32_t particle, Vec3 kick,
                       int64_t frames) {
  const Relation relation = {"no ghost force", "1", "oracles.md, Relations: the same bits",
                             "no other component is alive"};
  const Setup setup = without_debris(given);
  return judge_relation(relation, backend, kFrame, setup, state, [&](Verdict& verdict) {
    if (particle < 0 || particle >= setup.body.particle_count() || !state.alive[at(particle)]) {
      return vacuous(verdict, "the particle to be kicked is not alive");
    }
    if (state.frame >= setup.frame_count()) return vacuous(verdict, "the schedule is over");
    const Partition partition = graph_components(setup, state);
    const int32_t kicked = partition.label[at(particle)];
    const bool is_all = std::all_of(partition.label.begin(), partition.label.end(),
                                    [&](int32_t label) { return label < 0 || label == kicked; });
    if (is_all) return;  // no other piece could feel it
    const double dt = setup.substep_length[at(state.frame)];
    State disturbed_state = state;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (partition.label[i] != kicked) continue;
      disturbed_state.x[i] += kick;
      disturbed_state.v[i] += kick / dt;
    }
    const State quiet = after_frames(backend, setup, state, frames);
    const State moved = after_frames(backend, setup, disturbed_state, frames);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (!state.alive[i] || partition.label[i] == kicked) continue;
      ++verdict.checked;
      const Concerned both = {{}, {particle, static_cast<int32_t>(i)}};
      const auto felt = [&](const std::string& what) {
        violate(verdict, both,
                "particle {} {} because the component of particle {}, to which it is not connected, was kicked", i,
                what, particle);
      };
      if (quiet.alive[i] != moved.alive[i]) {
        felt("is removed in one run only");
      } else if (!same_bits(quiet.x[i], moved.x[i])) {
        felt(sentence("ends {} m elsewhere", norm(quiet.x[i] - moved.x[i])));
      } else if (!same_bits(quiet.v[i], moved.v[i])) {
        felt(sentence("ends {} m/s faster or slower", norm(quiet.v[i] - moved.v[i])));
      }
    }
  });
}

}  // namespace cutproof::oracles
