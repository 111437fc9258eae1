// The same input gives the same bits.
#include <fmt/format.h>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {
namespace {

Verdict run_twice(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  Verdict verdict = begin("determinism", backend, state, "1", "oracles.md, Relations: the same bits");
  if (auto unjudged = unable(verdict, backend, kFrame)) return *unjudged;
  std::vector<State> first;
  backend.load({setup}, {state});
  for (int64_t f = 0; f < frames; ++f) {
    backend.run(kFrame);
    first.push_back(backend.snapshot().at(0));
  }
  backend.load({setup}, {state});
  for (const State& expected : first) {
    backend.run(kFrame);
    ++verdict.checked;
    if (const auto found = bit_difference(expected, backend.snapshot().at(0))) {
      return fail_on(std::move(verdict), fmt::format("the second run, at the end of frame {}", expected.frame - 1),
                     *found);
    }
  }
  return verdict;
}

}  // namespace

Verdict determinism(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  return conclude(run_twice(backend, setup, state, frames), "no frame was run");
}

}  // namespace cutproof::oracles
