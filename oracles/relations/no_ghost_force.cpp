// Tissue that is not connected feels nothing of each other.
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

Verdict no_ghost_force(Backend& backend, const Setup& setup, const State& state, int32_t particle, Vec3 kick,
                       int64_t frames) {
  const Relation relation = {"no ghost force", "1", "oracles.md, Relations: the same bits",
                             "no other component is alive"};
  return judge_relation(relation, backend, kFrame, setup, state, [&](Verdict& verdict) {
    if (particle < 0 || particle >= setup.body.particle_count() || !state.alive[at(particle)]) {
      return vacuous(verdict, "the particle to be kicked is not alive");
    }
    if (state.frame >= setup.frame_count()) return vacuous(verdict, "the schedule is over");
    const Partition partition = graph_components(setup, state);
    const int32_t kicked = partition.label[at(particle)];
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
      if (same_bits(quiet.x[i], moved.x[i]) && same_bits(quiet.v[i], moved.v[i]) && quiet.alive[i] == moved.alive[i]) {
        continue;
      }
      violate(verdict, {{}, {particle, static_cast<int32_t>(i)}},
              "particle {} ends {} m elsewhere because the component of particle {}, to which it is not connected, was "
              "kicked",
              i, norm(quiet.x[i] - moved.x[i]), particle);
    }
  });
}

}  // namespace cutproof::oracles
