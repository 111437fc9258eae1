// A rigid translation is reproduced exactly.
#include <fmt/format.h>

#include <algorithm>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {
namespace {

Verdict throw_at_rest(Backend& backend, const Setup& setup, const State& given, Vec3 velocity) {
  const State state = in_arithmetic_of(backend, given);
  Verdict verdict = begin("translation is exact", backend, state, "h", "tolerances.md, One substep");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (auto unjudged = unable(verdict, backend, step_span(backend))) return *unjudged;
  if (setup.frame_count() == 0) return vacuous(verdict, "the schedule has no frames");
  Setup free = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
  free.step.damping = 0;
  State start = at_rest(free, state);
  for (Vec3& v : start.v) v = velocity;
  const double dt = free.substep_length[0];
  std::vector<Vec3> expected = start.x;
  for (Vec3& x : expected) x += dt * (velocity + dt * free.step.gravity);
  const State end = after_step(backend, free, start);

  const double h = setup.body.grid.spacing;
  State moved = start;
  moved.x = expected;
  int32_t where = -1;
  verdict.measured = greatest_distance(end, expected, where) / h;
  verdict.bound = substep_rounding(free, moved) / h;
  // Velocities are differences of positions over dt.
  for (std::size_t i = 0; i < end.v.size(); ++i) {
    if (!start.alive[i]) continue;
    const double error = dt * norm(end.v[i] - (velocity + dt * free.step.gravity)) / (2 * h);
    if (error <= verdict.measured) continue;
    verdict.measured = error;
    where = static_cast<int32_t>(i);
  }
  verdict.checked = static_cast<int64_t>(std::count(start.alive.begin(), start.alive.end(), 1));
  if (verdict.measured <= verdict.bound) return verdict;
  return fail(
      std::move(verdict),
      fmt::format("particle {} of a body that is thrown ends {} h from where it should", where, verdict.measured),
      {where});
}

}  // namespace

Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& given, Vec3 velocity) {
  return conclude(throw_at_rest(backend, setup, given, velocity), "nothing is alive");
}

}  // namespace cutproof::oracles
