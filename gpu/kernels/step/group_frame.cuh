// The two passes of a frame over the particles of groups. The first sums their initial displacements and velocities;
// the last stores their final ones.
#pragma once
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/frame_parts.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/moments.cuh"
#include "gpu/kernels/step/pace.cuh"
#include "gpu/kernels/step/particle.cuh"
#include "gpu/kernels/step/tracked.cuh"
#include "gpu/kernels/step/untouched.cuh"
#include "gpu/kernels/step/work.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Sums the initial state of a group, and begins its first substep.
template <bool kContacts, bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void begin_group(Block& block, const AnyTeam& team, const DeviceView& w, int g) {
  if constexpr (kContacts) {
    if (team.leads()) w.group_tracked[g] = kUntouched;
  }
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const Pace pace = constant(&w.pace[body_of_group(w, head)]);
  if (head.size == 0 || pace.substeps == 0) {
    // Lanes that read ahead read these before they know that the group has no work.
    if (!team.leads()) return;
    w.group_base[g] = Float4{};
    if constexpr (kContacts) w.group_resolved[g] = kCarried;
    return;
  }
  const float per_mass = 1.0f / constant(&w.group_mass[g]).w;
  const float per_holder = 1.0f / static_cast<float>(head.holder_count);
  const auto particle = [&](int k) { return w.place_particle[head.begin + k]; };
  const auto mass_share = [&](float mass) { return per_holder * mass; };
  // The first particle of each lane that this one stands for stays in registers; most have no other.
  constexpr int kFirst = AnyTeam::kLanes > 1 ? kParticleTeam / AnyTeam::kLanes : 1;
  static_assert(kFirst <= 2);
  Float4 first_place[kFirst], first_velocity[kFirst];
  int index[kFirst];
  for (int t = 0; t < kFirst; ++t) {
    const int k = team.lane() + t * team.kLanes;
    index[t] = k < head.size ? particle(k) : -1;
  }
  for (int t = 0; t < kFirst; ++t) {
    if (index[t] < 0) continue;
    first_place[t] = w.displacement[index[t]];
    first_velocity[t] = w.velocity[index[t]];
  }
  for (int t = 0; t < kFirst; ++t) first_velocity[t].w = first_place[t].w = mass_share(first_place[t].w);
  using Total = typename AnyTeam::template Parted<12>;
  const auto sum = [&](auto value, float far, Float4* rows, Total& total) {
    const Float4 base = sum_about<kParticleTeam>(team, w, group, pace, per_mass, far, value, total);
    total.each(team, [&](int n, float of) { store_moment(rows, g, n, of); });
    return base;
  };
  Origin origin;
  Total shape, motion;
  origin.place = sum(
      [&](int k) {
        if (k == team.lane()) return first_place[0];
        if (kFirst > 1 && k == team.lane() + team.kLanes) return first_place[kFirst - 1];
        const Float4 d = w.displacement[particle(k)];
        return with_w(xyz(d), mass_share(d.w));
      },
      kFarBase * pace.h, w.frame_shape, shape);
  origin.velocity = sum(
      [&](int k) {
        if (k == team.lane()) return first_velocity[0];
        if (kFirst > 1 && k == team.lane() + team.kLanes) return first_velocity[kFirst - 1];
        const int p = particle(k);
        return with_w(xyz(w.velocity[p]), mass_share(w.displacement[p].w));
      },
      kFarBase * pace.h / pace.prediction_time, w.frame_motion, motion);
  const Float3 common_place = origin.uniform() ? xyz(origin.place) : Float3{};
  const Float3 common_velocity = origin.uniform() ? xyz(origin.velocity) : Float3{};
  const Parts of_prediction = predicted_parts(pace, first_parts());
  Map from, to;
  for (int axis = 0; axis < 3; ++axis) {
    const Axis now = {{0, 0, 0, common_place[axis]}, {0, 0, 0, common_velocity[axis]}};
    from.row[axis] = now.place;
    to.row[axis] = predicted_row(pace, axis, now);
    if (!team.leads()) continue;
    w.group_place[3 * int64_t{g} + axis] = now.place;
    w.group_velocity[3 * int64_t{g} + axis] = now.velocity;
  }
  if (team.leads()) {
    w.group_origin[2 * int64_t{g}] = origin.place;
    w.group_origin[2 * int64_t{g} + 1] = origin.velocity;
  }
  if constexpr (kContacts) {
    const float room = note_room<kRetarded>(
        team, w, group, pace, contacts_of(w, pace, 0), origin, first_parts().place, of_prediction, [&] { return from; },
        to);
    if (!(room > 0) || held_by(w, pace, head.hold_set, 0).active) {
      team.sync();  // all lanes read the first lane's writes
      begin_tracked<kRetarded>(block, team, w, g, 0, 0, true);
      return;
    }
  } else if (team.leads()) {
    w.group_base[g] = with_w(origin.from(of_prediction.motion) + to.moved(), 0.0f);
  }
  shape.each(team, motion, [&](int n, float of_shape, float of_motion) {
    // (A is zero at the start of a frame.)
    const float moment = own_moment(of_prediction, of_shape, of_motion);
    store_moment(w.group_predicted, g, n, moment);
    store_moment(w.group_moments, g, n, moment);
  });
}

// Ends the frame of a group.
template <bool kContacts, bool kRetarded, class AnyTeam>
CUTPROOF_DEVICE void end_group(const AnyTeam& team, const DeviceView& w, int g) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (head.size == 0 || pace.substeps == 0) return;
  if constexpr (kContacts) {
    if (w.group_tracked[g] != kUntouched) {
      const Pace at_end = pace_at_end(w, body);
      const Ending ending = ending_of(w, body, pace.last_iterations, g);
      team.each(head.size, [&](int k) {
        const int p = w.place_particle[head.begin + k];
        Float3 v;
        w.displacement[p] = end_tracked<kRetarded>(w, at_end, group, ending, k, v);
        w.velocity[p] = with_w(v, 0.0f);
      });
      return;
    }
  }
  const Origin origin = origin_of(w, g);
  const FrameParts before = load_parts(w, body, pace.substeps - 1), after = load_parts(w, body, pace.substeps);
  const float lost = lost_in_all(w, body, pace.last_iterations);
  Map start, end;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 map = pace.last_iterations > 0 ? w.group_map[at] : Float4{};
    const Axis now = load_axis(w, at);
    start.row[axis] = now.place;
    end.row[axis] = axis_after<kRetarded>(pace, axis, lost, origin, predicted_parts(pace, before), map, now).place;
  }
  // Several particles are read at once: behind a store, each read would be waited for by itself.
  constexpr int kAtOnce = 2;
  CUTPROOF_ROLLED
  for (int begin = team.lane(); begin < head.size; begin += kAtOnce * team.kLanes) {
    int p[kAtOnce], node[kAtOnce];
    Own own[kAtOnce];
    for (int t = 0; t < kAtOnce; ++t) {
      const int k = begin + t * team.kLanes, o = head.begin + (k < head.size ? k : begin);
      p[t] = w.place_particle[o];
      node[t] = constant(&w.place_node[o]);
    }
    for (int t = 0; t < kAtOnce; ++t) own[t] = own_of(w, p[t], origin);
    for (int t = 0; t < kAtOnce; ++t) {
      if (begin + t * team.kLanes >= head.size) break;
      const Float3 r = group.offset_at(pace, node[t]), d = brought_to(end, after.place, origin, own[t], r);
      // The velocity follows from the rounded positions, because the particle has moved between these. A sum of the
      // same form as d would round otherwise.
      const Float3 v = pace.decay_per_dt * (d - brought_to(start, before.place, origin, own[t], r));
      w.displacement[p[t]] = with_w(d, own[t].displacement.w);
      w.velocity[p[t]] = with_w(v, 0.0f);
    }
  }
}

}  // namespace cutproof::gpu::step_detail
