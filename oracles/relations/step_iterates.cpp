// A step, iterate by iterate, as the backend itself shows them.
#include "oracles/iterates/probe.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

Verdict step_by_iterates(Backend& backend, const Setup& setup, const State& given, Iterates wanted, uint64_t seed) {
  const State state = in_arithmetic_of(backend, given);
  const Relation relation = {kStepByIterates, kIteratesUnit, kIteratesSource, kNoIterates};
  return judge_relation(relation, backend, step_span(backend), setup, state, [&](Verdict& verdict) {
    if (state.frame >= setup.frame_count()) return vacuous(verdict, "the schedule is over");
    const IterateProbe probe(setup, state, wanted, seed);
    probe.judge(shown_iterates(backend, {&probe, 1}).front(), verdict);
  });
}

}  // namespace cutproof::oracles
