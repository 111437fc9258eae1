// Substeps of tracked groups, which a contact or a grip has touched in this frame. Each substep begins with their
// particles' positions.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/moments.cuh"
#include "gpu/kernels/step/particle.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/kernels/step/untouched.cuh"
#include "gpu/kernels/step/work.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// The state in which the previous substep left a tracked group.
struct Ending {
  Map map;
  Float3 base;
  float lost;
  int state;
};
CUTPROOF_DEVICE inline Ending ending_of(const DeviceView& w, int body, int iterations, int g) {
  Ending ending = {{}, xyz(w.group_base[g]), lost_in_all(w, body, iterations), w.group_resolved[g]};
  if (iterations > 0) ending.map = load_map(w.group_map, g);
  return ending;
}
// Displacement and mass of particle k of a tracked group at the end of a substep. Sets its velocity, and ends its
// impulse.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float4 end_tracked(const DeviceView& w, const Pace& pace, const Group& group,
                                          const Ending& ending, int k, Float3& v) {
  const int o = group.head.begin + k;
  const Float4 start = w.start[o];
  const Float3 predicted = xyz(w.predicted[o]), r = group.offset(w, pace, k);
  Float3 y = carried_to(ending.base, ending.lost, predicted, ending.map, r);
  Float3 pushed;
  if (ending.state != kCarried) y = xyz(w.position[o]);
  if (ending.state == kResolved) pushed = xyz(w.pushed[o]);
  if (ending.state == kHeld) {
    pushed = pace.held_alpha * (y - predicted) + (pace.held_beta * (predicted - ending.base) - ending.map(r));
    if constexpr (kRetarded) pushed = pace.dt_fraction * pushed;
  }
  const Float3 d =
      ending.state == kCarried ? x_between<kRetarded>(pace, xyz(start), y) : x_of<kRetarded>(w, pace, o, y);
  end_impulse(w, w.place_particle[o], pace, pushed);
  v = pace.decay_per_dt * (d - xyz(start));
  return with_w(d, start.w);
}

// Begins a substep of a tracked group. begins: it is tracked from this substep on.
template <bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void begin_tracked(Block& block, const AnyTeam& team, const DeviceView& w, int g, int substep,
                                   int tracked_so_far, bool begins) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (substep >= pace.substeps) return;
  const Contacts contacts = contacts_of(w, pace, substep);
  const Held held = held_by(w, pace, head.hold_set, substep);
  Float3 base;
  bool resolve = true;
  // This lane's first particle, usually its only one, stays in registers. Reading back what was just written would cost
  // a wait.
  const int first = team.lane();
  Float4 first_start, first_predicted;
  const auto start_of = [&](int k) { return k == first ? first_start : w.start[head.begin + k]; };
  const auto predicted_of = [&](int k) { return k == first ? first_predicted : w.predicted[head.begin + k]; };
  if (begins) {
    base = track_particles(team, w, group, pace, contacts, held.active, substep);
    if (first < head.size) {
      first_start = w.start[head.begin + first];
      first_predicted = w.predicted[head.begin + first];
    }
    list_tracked(block, team, w, g, substep, tracked_so_far);
  } else {
    const Ending ending = ending_of(w, body, pace.iterations, g);
    const float per_holder = 1.0f / static_cast<float>(head.holder_count);
    bool in_front = false, in_back = false;  // of the blade, at the start of the substep
    Float3 start_base;                       // a displacement of one of its particles at the start of the substep
    float start_reach = 0;                   // squared bound of its particles' distances from there
    if (is_retarded<kRetarded>(pace)) {
      start_base = xyz(w.start[head.begin]);
      team.sync();  // all lanes have read it
    }
    team.each(head.size, [&](int k) {
      const int o = head.begin + k;
      Float3 v;
      const Float4 d = end_tracked<kRetarded>(w, pace, group, ending, k, v);
      float side = 0.0f;
      if (!held.active) {
        side = blade_side(contacts, {pace.h, grid_node(pace, constant(&w.place_node[o]))}, xyz(d));
        (side < 0 ? in_back : in_front) = true;
      }
      const Float4 predicted = with_w(predict(pace, xyz(d), v), side);
      if constexpr (kRetarded) {
        const Float3 off = xyz(d) - start_base;
        start_reach = fmaxf(start_reach, dot(off, off));
      }
      w.start[o] = d;
      w.predicted[o] = predicted;
      if (k == first) {
        first_start = d;
        first_predicted = predicted;
      }
    });
    typename AnyTeam::template Parted<12> total;
    const Float4 base_and_reach = sum_about<kResolvedTeam>(
        team, w, group, pace, 1.0f / constant(&w.group_mass[g]).w, kFarBase * pace.h,
        [&](int k) { return with_w(xyz(predicted_of(k)), per_holder * start_of(k).w); }, total);
    in_front = team.any(in_front);
    in_back = team.any(in_back);
    const int side = in_front && in_back ? 0 : in_back ? -1 : 1;
    // (The room of a held group is unused.)
    const Ball ball = ball_around(pace, group, base_and_reach, 1.0f, Map{});
    Ball start_ball = {};
    if constexpr (kRetarded) {
      start_ball = ball_around(
          pace, group, with_w(start_base, sqrtf(team.greatest(start_reach)) * (1.0f + kPartForRounding)), 1.0f, Map{});
    }
    const float room = held.active ? 0.0f : room_of_prediction<kRetarded>(pace, contacts, start_ball, ball, side);
    resolve = !(room > 0);
    base = xyz(base_and_reach);
    if (team.leads()) {
      w.group_base[g] = base_and_reach;
      w.group_room[g] = room;
      w.group_side[g] = side;
      w.group_resolved[g] = kCarried;
    }
    total.each(team, [&](int n, float sum) {
      store_moment(w.group_predicted, g, n, sum);
      if (!resolve) store_moment(w.group_moments, g, n, sum);
    });
  }
  if (!resolve) return;
  if (held.active) {
    if (team.leads()) w.group_resolved[g] = kHeld;
  } else {
    list_resolved(block, team, w, pace, g, substep, 0);
  }
  Float4 first_at;
  team.each(head.size, [&](int k) {
    const int o = head.begin + k;
    const RestPoint rest = {pace.h, grid_node(pace, constant(&w.place_node[o]))};
    const Float4 start = start_of(k);
    const Float3 y = enter_substep<kRetarded>(w, pace, contacts, held, rest, o, predicted_of(k), xyz(start), 0.0f);
    if (k == first) first_at = with_w(y, start.w);
  });
  sum_resolved(team, w, group, pace, base, first_at);
}

}  // namespace cutproof::gpu::step_detail
