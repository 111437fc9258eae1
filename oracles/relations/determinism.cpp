// The same input gives the same bits.
#include <fmt/format.h>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

Verdict determinism(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  const Relation relation = {"determinism", "1", "oracles.md, Relations: the same bits", "no frame was run"};
  return judge_relation(relation, backend, kFrame, setup, state, [&](Verdict& verdict) {
    const std::vector<State> first = after_each(backend, setup, state, std::vector<Span>(at(frames), kFrame));
    backend.load({setup}, {state});
    for (const State& expected : first) {
      backend.run(kFrame);
      ++verdict.checked;
      const std::string where = fmt::format("the second run, at the end of frame {}", expected.frame - 1);
      if (!require_same_bits(verdict, where, expected, backend.snapshot().at(0))) return;
    }
  });
}

}  // namespace cutproof::oracles
