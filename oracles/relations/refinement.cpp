// Pieces that a stroke has separated stay separate.
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

Verdict refinement(Backend& backend, const Setup& more, const State& state, int64_t fewer_frames) {
  const Relation relation = {"refinement", "1", "oracles.md, Relations: a stroke only refines", "nothing is alive"};
  return judge_relation(relation, backend, kFrame, more, state, [&](Verdict& verdict) {
    Setup fewer = more;
    const auto substeps = at(fewer_frames * more.step.substeps);
    fewer.substep_length.resize(at(fewer_frames));
    for (int64_t& end : fewer.stroke_end) end = end < fewer_frames ? end : -1;
    if (!fewer.blade_moves.empty()) fewer.blade_moves.resize(substeps);
    for (Grip& grip : fewer.grips) {
      grip.active.resize(substeps);
      grip.displacement.resize(substeps);
    }
    const State coarse = after_frames(backend, fewer, state, fewer_frames - state.frame);
    const State fine = after_frames(backend, more, state, more.frame_count() - state.frame);
    const Partition before = graph_components(fewer, coarse), now = graph_components(more, fine);
    // For each component of the finer partition, a particle of it.
    std::vector<int32_t> first(at(now.count), -1);
    for (int32_t i = 0; i < more.body.particle_count(); ++i) {
      if (!fine.alive[at(i)]) continue;
      ++verdict.checked;
      if (!coarse.alive[at(i)]) {
        return violate(verdict, {{}, {i}}, "particle {} is dead after fewer strokes and alive after more", i);
      }
      int32_t& other = first[at(now.label[at(i)])];
      if (other < 0) other = i;
      if (before.label[at(other)] == before.label[at(i)]) continue;
      return violate(verdict, {{}, {other, i}},
                     "particles {} and {} are separate after fewer strokes and connected after more", other, i);
    }
  });
}

}  // namespace cutproof::oracles
