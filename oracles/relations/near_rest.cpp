// One substep of a body at rest, or thrown: the rest state is a fixed point, and a rigid translation is reproduced
// exactly.
#include <fmt/format.h>

#include <algorithm>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"
#include "oracles/rounding.h"
#include "oracles/step_model/admissible_step.h"

namespace cutproof::oracles {
namespace {

// The same tissue and clusters, at rest; each particle with this velocity.
State at_rest(const Setup& setup, const State& state, Vec3 velocity) {
  State rest = state;
  rest.frame = 0;
  rest.v.assign(state.v.size(), velocity);
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) rest.x[at(i)] = setup.body.rest_position(i);
  }
  rest.removed.clear();
  rest.debris.clear();
  rest.clusters.rotation.assign(at(state.clusters.count()), Mat3{});
  rest.impulse = {};
  rest.skin = {};
  return rest;
}

// Takes one substep from rest with this velocity and the forces of `free`, and expects a rigid motion.
Verdict throw_body(const Relation& relation, Backend& backend, const Setup& setup, const State& given, Vec3 velocity,
                   void (*free)(StepParameters&), bool also_velocities, fmt::format_string<int32_t&, Figure> text) {
  const State state = in_arithmetic_of(backend, given);
  return judge_relation(relation, backend, step_span(backend), setup, state, [&](Verdict& verdict) {
    if (setup.frame_count() == 0) return vacuous(verdict, "the schedule has no frames");
    Setup one = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
    free(one.step);
    const double h = setup.body.grid.spacing, dt = one.substep_length[0];
    const State start = at_rest(one, state, velocity);
    State moved = start;
    for (Vec3& v : moved.v) v += dt * one.step.gravity;
    for (std::size_t i = 0; i < moved.x.size(); ++i) moved.x[i] += dt * moved.v[i];
    const State end = after(backend, one, start, step_span(backend));
    // The answer is known; its rounding is that of the step.
    const StepAgain again = step_again(one, start, end);
    if (!again.step) return fail(verdict, {}, "{}", again.verdict.witness.text);
    Nearest nearest;
    for (std::size_t i = 0; i < moved.x.size(); ++i) {
      if (start.alive[i] == 0) continue;
      ++verdict.checked;
      const auto index = static_cast<int32_t>(i);
      nearest.see(norm(end.x[i] - moved.x[i]) / h, again.step->position_bound[i], index);
      if (also_velocities) nearest.see(norm(end.v[i] - moved.v[i]) * dt / h, again.step->velocity_bound[i], index);
    }
    if (verdict.checked == 0) return;
    verdict.measured = nearest.measured;
    verdict.bound = nearest.bound;
    if (!nearest.holds()) fail(verdict, {{}, {nearest.where}}, text, nearest.where, nearest.measured);
  });
}

}  // namespace

Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& state) {
  const Relation relation = {"rest is fixed", "h", "tolerances.md, At rest", "nothing is alive"};
  const auto calm = [](StepParameters& step) { step.gravity = {}; };
  return throw_body(
      relation, backend, setup, state, {}, calm, false,
      "in a second run of one substep, in which the body is at rest and no force acts, particle {} moves by {} h; "
      "pictures show the run itself");
}

Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& state, Vec3 velocity) {
  const Relation relation = {"translation is exact", "h", "tolerances.md, At rest", "nothing is alive"};
  const auto undamped = [](StepParameters& step) { step.damping = 0; };
  return throw_body(
      relation, backend, setup, state, velocity, undamped, true,
      "in a second run of one substep, in which the body is thrown and only gravity acts, particle {} ends {} h "
      "from where it should; pictures show the run itself");
}

}  // namespace cutproof::oracles
