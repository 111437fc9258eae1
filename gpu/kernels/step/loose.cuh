// Loose particles, which are in no group: their substeps and iterations, one particle to a thread.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/make_groups.cuh"
#include "gpu/kernels/step/particle.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Displacement and mass of a loose particle at the start of this substep, the end of the previous one. Sets its
// velocity.
template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline Float4 end_loose(const DeviceView& w, const Pace& pace, int o, int p, int substep, Float3& v) {
  if (substep == 0) {
    v = xyz(w.velocity[p]);
    return w.displacement[p];
  }
  const Float4 start = w.start[o];
  static_assert(kContacts || !kRetarded);  // loads with retardation have DeviceView::place (plan.h)
  const Float3 d = x_of<kRetarded>(w, pace, o, xyz(w.position[o]));
  if constexpr (kContacts) end_impulse(w, p, pace, xyz(w.pushed[o]));
  v = pace.decay_per_dt * (d - xyz(start));
  return with_w(d, start.w);
}

// Begins a substep of the loose particle at place o; there is none where o < 0.
template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline void begin_loose(const DeviceView& w, int o, int substep) {
  if (o < 0) return;
  const int p = w.place_particle[o];
  const Pace pace = constant(&w.pace[body_index(w, p)]);
  if (substep >= pace.substeps) return;
  Float3 v;
  const Float4 d = end_loose<kContacts, kRetarded>(w, pace, o, p, substep, v);
  const float mass_share = d.w / static_cast<float>(w.membership_count[p]);
  Float4 predicted = with_w(predict(pace, xyz(d), v), 1.0f);
  w.start[o] = d;
  if constexpr (kContacts) {
    const Contacts contacts = contacts_of(w, pace, substep);
    const RestPoint rest = {pace.h, grid_node(pace, constant(&w.place_node[o]))};
    const Held held = held_by(w, pace, groups_detail::hold_set(w, p), substep);
    predicted.w = held.active ? 0.0f : blade_side(contacts, rest, xyz(d));
    enter_substep<kRetarded>(w, pace, contacts, held, rest, o, predicted, xyz(d), mass_share);
  } else {
    w.position[o] = with_w(xyz(predicted), mass_share);
  }
  w.predicted[o] = predicted;
}

// Ends the frame of the loose particle at place o.
template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline void finish_loose(const DeviceView& w, int o) {
  if (o < 0) return;
  const int p = w.place_particle[o];
  const Pace pace = constant(&w.pace[body_index(w, p)]);
  if (pace.substeps == 0) return;
  Float3 v;
  w.displacement[p] = end_loose<kContacts, kRetarded>(w, pace, o, p, pace.substeps, v);
  w.velocity[p] = with_w(v, 0.0f);
}

// Advances the loose particle at place o by an iteration. kAhead: the number of its clusters whose rest positions are
// read before the wait.
template <bool kContacts, bool kAccelerated, bool kRetarded, int kAhead, class Block>
CUTPROOF_DEVICE void advance_loose(Block& block, const DeviceView& w, int o, int substep, int iteration) {
  if (o < 0) return;
  const int p = w.place_particle[o], body = body_index(w, p);
  const Pace pace = constant(&w.pace[body]);
  if (!takes_part(pace, substep, iteration)) return;
  const Iteration now = iteration_of(w, body, pace, iteration);
  const Particle particle = particle_at<kContacts, kAccelerated>(w, now, o);
  const Float3 at = xyz(particle.at), from = now.implicit ? xyz(particle.predicted) : at;
  // The mean of the goals is summed relative to `from`: sums of small numbers cost no digits of d.
  const int clusters = w.membership_count[p], begin = w.membership_begin[p];
  const Contacts contacts = kContacts ? contacts_of(w, pace, substep) : Contacts{};
  const Coordinates c = coordinates(pace, particle.node);
  struct Holder {
    int slot;
    Float3 r;
  };
  const auto holder_at = [&](int k) {
    const int slot = constant(&w.memberships[begin + (k < clusters ? k : 0)]);
    return Holder{slot, pace.h * nodes_from_rest_center(w, c, slot)};
  };
  Holder ahead[kAhead] = {};
  if (clusters > 0) {
    for (int t = 0; t < kAhead; ++t) ahead[t] = holder_at(t);
  }
  block.wait_for_earlier();  // for the clusters; all other data is older
  Float3 pull = at - from;   // without clusters its own place is the goal
  if (clusters > 0) {
    Float3 sum;
    // Several are read at once: one by one, each would wait for the previous one.
    constexpr int kAtOnce = 4;
    static_assert(kAhead % kAtOnce == 0);
    const auto add = [&](const Holder* some, int first) {
      Map place[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) place[t] = load_map(w.placement, some[t].slot);
      for (int t = 0; t < kAtOnce; ++t) {
        if (first + t >= clusters) break;
        const Float4* const row = place[t].row;
        const Float3 r = some[t].r, center = {row[0].w, row[1].w, row[2].w};
        const Float3 turned = {row[0].x * r.x + row[0].y * r.y + row[0].z * r.z,
                               row[1].x * r.x + row[1].y * r.y + row[1].z * r.z,
                               row[2].x * r.x + row[2].y * r.y + row[2].z * r.z};
        sum = sum + ((1.0f - pace.volume_share) * (center - from) + turned);
      }
    };
    for (int first = 0; first < kAhead; first += kAtOnce) {
      if (first < clusters) add(ahead + first, first);
    }
    CUTPROOF_ROLLED for (int first = kAhead; first < clusters; first += kAtOnce) {
      for (int t = 0; t < kAtOnce; ++t) ahead[t] = holder_at(first + t);
      add(ahead, first);
    }
    pull = pace.volume_share * (at - from) + (1.0f / static_cast<float>(clusters)) * sum;
  }
  advance_particle<kContacts, kAccelerated, kRetarded>(w, pace, contacts, now, o, particle, from, pull);
}

}  // namespace cutproof::gpu::step_detail
