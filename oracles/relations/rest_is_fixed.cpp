// The rest state is a fixed point.
#include <fmt/format.h>

#include <algorithm>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {
namespace {

Verdict let_rest(Backend& backend, const Setup& setup, const State& given) {
  const State state = in_arithmetic_of(backend, given);
  Verdict verdict = begin("rest is fixed", backend, state, "h", "tolerances.md, One substep");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (auto unjudged = unable(verdict, backend, step_span(backend))) return *unjudged;
  if (setup.frame_count() == 0) return vacuous(verdict, "the schedule has no frames");
  Setup calm = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
  calm.step.gravity = {};
  const State rest = at_rest(calm, state);
  const State end = after_step(backend, calm, rest);
  const double h = setup.body.grid.spacing;
  int32_t where = -1;
  verdict.measured = greatest_distance(end, rest.x, where) / h;
  verdict.bound = substep_rounding(calm, rest) / h;
  verdict.checked = static_cast<int64_t>(std::count(rest.alive.begin(), rest.alive.end(), 1));
  if (verdict.measured <= verdict.bound) return verdict;
  return fail(std::move(verdict),
              fmt::format("particle {} of the rest state moves by {} h in one substep", where, verdict.measured),
              {where});
}

}  // namespace

Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& given) {
  return conclude(let_rest(backend, setup, given), "nothing is alive");
}

}  // namespace cutproof::oracles
