// A particle with a position of its own, because it is loose or its group is resolved: grips, contacts and impulse at
// the start of a substep, and an iteration.
#pragma once
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// The displacement [m] from the start of a substep that the active grip of a set gives its particles. At most one grip
// of a set is active at a time (model/setup.h).
struct Held {
  bool active = false;
  Float3 moved;
};
CUTPROOF_DEVICE inline Held held_by(const DeviceView& w, const Pace& pace, int set, int substep) {
  Held held;
  if (set == 0) return held;
  for (int k = w.hold_begin[set]; k < w.hold_begin[set + 1]; ++k) {
    const int64_t entry = w.grips[w.hold_grips[k]].table + int64_t{pace.frame} * pace.substeps + substep;
    if (w.grip_active[entry]) held = {true, w.grip_displacement[entry]};
  }
  return held;
}

// Moves a particle from its prediction to where contacts, or its grip, allow it. Stores that position and the
// displacement from the prediction. Returns its y. mass_share: the mass that each of its holders gets.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 enter_substep(const DeviceView& w, const Pace& pace, const Contacts& contacts,
                                            const Held& held, const RestPoint& rest, int64_t o, Float4 predicted,
                                            Float3 start, float mass_share) {
  bool in_turn = false;  // unused: there is no earlier point to compare with
  const Float3 free_x = x_between<kRetarded>(pace, start, xyz(predicted));
  const Float3 x = held.active ? start + held.moved : project(contacts, rest, free_x, predicted.w, start, in_turn);
  const Float3 y = y_ahead_of<kRetarded>(pace, x, free_x, xyz(predicted));
  w.position[o] = with_w(y, mass_share);
  if (is_retarded<kRetarded>(pace)) w.place[o] = with_w(x, 0.0f);
  w.pushed[o] = with_w(x - free_x, 0.0f);
  return y;
}

// Adds the push of a substep to the impulse of a particle.
CUTPROOF_DEVICE inline void end_impulse(const DeviceView& w, int p, const Pace& pace, Float3 pushed) {
  w.impulse[p] = with_w(pace.decay * xyz(w.impulse[p]) + pace.decay_per_dt * pushed, 0.0f);
}

// A particle's data in an iteration.
struct Particle {
  Float4 predicted, at;
  Float4 start;                            // with contacts…
  Float4 pushed, earlier, pushed_earlier;  // … and accelerated
  int node;
};
template <bool kContacts, bool kAccelerated>
CUTPROOF_DEVICE inline Particle particle_at(const DeviceView& w, const Iteration& now, int64_t o) {
  Particle found;
  found.predicted = w.predicted[o];
  found.at = w.position[o];
  found.node = constant(&w.place_node[o]);
  if constexpr (kContacts) {
    found.start = w.start[o];
    found.pushed = w.pushed[o];
  }
  if constexpr (kAccelerated) {
    if (now.combined) found.earlier = w.earlier[o];
    if constexpr (kContacts) {
      if (now.combined) found.pushed_earlier = w.pushed_earlier[o];
    }
  }
  return found;
}

// Advances the particle at place o by an iteration, towards `from` + pull. from: its prediction (implicit) or its
// position (published). Returns its next y.
template <bool kContacts, bool kAccelerated, bool kRetarded>
CUTPROOF_DEVICE inline Float3 advance_particle(const DeviceView& w, const Pace& pace, const Contacts& contacts,
                                               const Iteration& now, int64_t o, const Particle& particle, Float3 from,
                                               Float3 pull) {
  const Float3 y = xyz(particle.at);
  const Float3 plain = from + now.s * pull;
  Float3 free = plain;
  if constexpr (kAccelerated) {
    if (now.combined) free = now.combination(plain, y, xyz(particle.earlier));
    if (now.keeps) w.earlier[o] = particle.at;
  }
  Float3 next = free;
  if constexpr (kContacts) {
    const float side = particle.predicted.w;
    const Float3 start = xyz(particle.start), free_x = x_between<kRetarded>(pace, start, free);
    Float3 push;
    if (side == 0) {
      next = y;  // a grip holds its particles in place
      push = x_of<kRetarded>(w, pace, o, y) - free_x;
    } else {
      const RestPoint rest = {pace.h, grid_node(pace, particle.node)};
      const Float3 plain_x = x_between<kRetarded>(pace, start, plain);
      Float3 wanted_x = free_x;
      if constexpr (kAccelerated) {
        // Of several fixed points the path decides; touched particles take the plain iterate.
        if (now.combined && path_matters(contacts)) {
          bool touched = false;
          CUTPROOF_ROLLED
          for (int k = 0; k < 2; ++k) {
            touched = touched || contacts_detail::touches(contacts, rest, k == 0 ? free_x : plain_x, side);
          }
          if (touched) wanted_x = plain_x;
        }
      }
      const Float3 next_x = next_position(contacts, rest, wanted_x, side, start, x_of<kRetarded>(w, pace, o, y));
      if (is_retarded<kRetarded>(pace)) w.place[o] = with_w(next_x, 0.0f);
      push = next_x - free_x;
      next = y_ahead_of<kRetarded>(pace, next_x, free_x, free);
    }
    const Float3 pushed = xyz(particle.pushed);
    Float3 kept_push = (now.implicit ? now.s : 1.0f) * pushed;
    if constexpr (kAccelerated) {
      if (now.combined) kept_push = now.combination(kept_push, pushed, xyz(particle.pushed_earlier));
      if (now.keeps) w.pushed_earlier[o] = particle.pushed;
    }
    w.pushed[o] = with_w(kept_push + push, 0.0f);
  }
  w.position[o] = with_w(next, particle.at.w);
  return next;
}

}  // namespace cutproof::gpu::step_detail
