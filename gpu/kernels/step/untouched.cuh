// Substeps of groups that nothing has touched in this frame. Such a group has no positions of particles: an affine map
// and the numbers of frame_parts.cuh take it from substep to substep.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/frame_parts.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/particle.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// One axis of an untouched group: the row of A with T in w, and the same for velocities.
struct Axis {
  Float4 place, velocity;
};
CUTPROOF_DEVICE inline Axis load_axis(const DeviceView& w, int64_t at) {
  return {w.group_place[at], w.group_velocity[at]};
}
// The row of its prediction, computed as predict() does.
CUTPROOF_DEVICE inline Float4 predicted_row(const Pace& pace, int axis, const Axis& now) {
  return {now.place.x + pace.prediction_time * now.velocity.x, now.place.y + pace.prediction_time * now.velocity.y,
          now.place.z + pace.prediction_time * now.velocity.z,
          now.place.w + (pace.prediction_time * now.velocity.w + pace.fall[axis])};
}
// The common part of a group's particles at the start of the frame.
struct Origin {
  Float4 place, velocity;  // D and V; w: bounds of every |u| and every |m|
  CUTPROOF_DEVICE bool uniform() const { return place.w == 0 && velocity.w == 0; }
  // The base of the group less T. motion: the remaining part of the motion.
  CUTPROOF_DEVICE Float3 from(float motion) const { return uniform() ? Float3{} : xyz(place) + motion * xyz(velocity); }
};
CUTPROOF_DEVICE inline Origin origin_of(const DeviceView& w, int g) {
  return {w.group_origin[2 * int64_t{g}], w.group_origin[2 * int64_t{g} + 1]};
}

// One axis after a substep that ends with the map of this row. predicted_part: of the prediction of that substep.
template <bool kRetarded>
CUTPROOF_DEVICE inline Axis axis_after(const Pace& pace, int axis, float lost, const Origin& origin,
                                       const Parts& predicted_part, Float4 map, const Axis& now) {
  const Float4 predicted = predicted_row(pace, axis, now);
  const auto entry_after = [&](float was, float is, float by_map) {
    return x_between<kRetarded>(pace, was, is + (by_map - lost * is));
  };
  const auto rate = [&](float is, float was) { return pace.decay_per_dt * (is - was); };
  const float lost_motion = origin.uniform() ? 0.0f : lost * (predicted_part.motion * xyz(origin.velocity)[axis]);
  Axis next;
  next.place = {entry_after(now.place.x, predicted.x, map.x), entry_after(now.place.y, predicted.y, map.y),
                entry_after(now.place.z, predicted.z, map.z),
                x_between<kRetarded>(pace, now.place.w, predicted.w + (map.w + lost_motion))};
  next.velocity = row_of(rate, next.place, now.place);
  return next;
}

// A particle's own part at the start of the frame.
struct Own {
  Float4 displacement;   // displacement; w: mass
  Float3 shape, motion;  // u; v
};
CUTPROOF_DEVICE inline Own own_of(const DeviceView& w, int p, const Origin& origin) {
  const Float4 d = w.displacement[p];
  return {d, xyz(d) - xyz(origin.place), xyz(w.velocity[p])};
}
// The position of a particle of an untouched group. The group's contribution is small where little has happened,
// wherever the other particles are.
CUTPROOF_DEVICE inline Float3 brought_to(const Map& map, const Parts& parts, const Origin& origin, const Own& own,
                                         Float3 r) {
  const Float3 turned = map.linear(r);
  if (origin.uniform()) return map.moved() + turned;
  return xyz(own.displacement) + (parts.motion * own.motion + (map.moved() + (parts.shape * own.shape + turned)));
}

// Gives the particles of an untouched group positions of their own: the start of the substep and the prediction.
// Returns the base of the prediction.
template <class AnyTeam>
CUTPROOF_DEVICE Float3 track_particles(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                       const Contacts& contacts, bool held, int substep) {
  const int64_t g = group.index;
  const FrameParts parts = load_parts(w, body_of_group(w, group.head), substep);
  const Parts of_prediction = predicted_parts(pace, parts);
  const Origin origin = origin_of(w, group.index);
  Map start_map, predicted_map;
  for (int axis = 0; axis < 3; ++axis) {
    const Axis now = load_axis(w, 3 * g + axis);
    start_map.row[axis] = now.place;
    predicted_map.row[axis] = predicted_row(pace, axis, now);
  }
  team.each(group.head.size, [&](int k) {
    const int o = group.head.begin + k, node = constant(&w.place_node[o]);
    const Own own = own_of(w, w.place_particle[o], origin);
    const Float3 r = group.offset_at(pace, node), start = brought_to(start_map, parts.place, origin, own, r);
    const float side = held ? 0.0f : blade_side(contacts, {pace.h, grid_node(pace, node)}, start);
    w.start[o] = with_w(start, own.displacement.w);
    w.predicted[o] = with_w(brought_to(predicted_map, of_prediction, origin, own, r), side);
  });
  return origin.from(of_prediction.motion) + predicted_map.moved();
}

// Stores the base of an untouched group in this substep, and its room: how far its particles may go from their
// predictions. Returns the room; if it is not positive, a contact may touch the group. from: returns the map of the
// start of the substep, with `parts`; called only for a blade or retardation. to: the map of the prediction, with
// `of_prediction`.
template <bool kRetarded, class AnyTeam, class From>
CUTPROOF_DEVICE float note_room(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                const Contacts& contacts, const Origin& origin, const Parts& parts,
                                const Parts& of_prediction, From from, Map to) {
  const int g = group.index;
  Float4 base = with_w(origin.from(of_prediction.motion) + to.moved(), 0.0f);
  for (Float4& row : to.row) row.w = 0;
  // A bound of the remaining u and v of any particle.
  const auto reach_of = [&](const Parts& part) {
    return (fabsf(1.0f + part.shape) * origin.place.w + fabsf(part.motion) * origin.velocity.w) *
           (1.0f + kPartForRounding);
  };
  const float own_reach = reach_of(of_prediction);
  base.w = (greatest_stretch(to, 0.0f) * group.head.radius + own_reach) * (1.0f + kPartForRounding);
  int side = 1;
  Ball start = {};
  if (contacts.move != nullptr || is_retarded<kRetarded>(pace)) {
    start = ball_around(pace, group, with_w(origin.from(parts.motion), reach_of(parts)), 1.0f, from());
    if (contacts.move != nullptr) side = side_of_all(contacts, start);
  }
  // An iteration adds M(r) and removes a part l of e. A ball that also contains the rest shape contains every d~ - l e,
  // for l from 0 to 1. Where β > 0, accelerated iterations may lose up to 2 e.
  Ball ball = ball_around(pace, group, with_w(xyz(base), own_reach), 1.0f, to);
  ball.radius = fmaxf(ball.radius, pace.h * group.head.radius + (pace.volume_share > 0 ? base.w : 0.0f));
  const float room = room_of_prediction<kRetarded>(pace, contacts, start, ball, side);
  if (team.leads()) {
    w.group_base[g] = base;
    w.group_room[g] = room;
    w.group_side[g] = side;
    w.group_resolved[g] = kCarried;
  }
  return room;
}

// Begins a substep of a group that nothing has touched so far. Returns whether its particles must be tracked, because a
// contact may touch its prediction or a grip holds it.
template <bool kContacts, bool kRetarded, class Block, int kRows>
CUTPROOF_DEVICE bool begin_untouched(Block& block, const Team<Block, kRows>& team, const DeviceView& w, int g,
                                     int substep) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  const Contacts contacts = kContacts ? contacts_of(w, pace, substep) : Contacts{};
  const Float4 mass = constant(&w.group_mass[g]), upper = constant(&w.group_spread[2 * int64_t{g}]),
               lower = constant(&w.group_spread[2 * int64_t{g} + 1]);
  const bool active = head.size > 0 && substep < pace.substeps;
  FrameParts parts = {};  // a body has none of further substeps
  if (active) parts = load_parts(w, body, substep);
  const Parts of_prediction = predicted_parts(pace, parts);
  Parts of_last_prediction = {};
  if (active) of_last_prediction = predicted_parts(pace, load_parts(w, body, substep - 1));
  const float lost = lost_in_all(w, body, pace.iterations), per_h = pace.per_h;
  block.wait_for_earlier();
  if (!active) return false;
  [[maybe_unused]] int state = kUntouched;
  if constexpr (kContacts) state = w.group_tracked[g];
  // Everything is read before anything is written: behind a store, each read would be waited for by itself.
  Rows<Team<Block, kRows>> place, velocity, map, shape, motion;
  const Origin origin = origin_of(w, g);
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    place.of(axis) = w.group_place[at];
    velocity.of(axis) = w.group_velocity[at];
    if (pace.iterations > 0) map.of(axis) = w.group_map[at];
    shape.of(axis) = w.frame_shape[at];
    motion.of(axis) = w.frame_motion[at];
  });
  if (state != kUntouched) return false;
  Rows<Team<Block, kRows>>& predicted = map;
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Axis now = axis_after<kRetarded>(pace, axis, lost, origin, of_last_prediction, map.of(axis),
                                           {place.of(axis), velocity.of(axis)});
    place.of(axis) = w.group_place[at] = now.place;
    w.group_velocity[at] = now.velocity;
    predicted.of(axis) = predicted_row(pace, axis, now);
  });
  if constexpr (kContacts) {
    const float room = note_room<kRetarded>(
        team, w, group, pace, contacts, origin, parts.place, of_prediction, [&] { return place.all(team); },
        predicted.all(team));
    if (!(room > 0) || held_by(w, pace, head.hold_set, substep).active) return true;
  } else {
    const Float3 base = origin.from(of_prediction.motion) + predicted.all(team).moved();
    if (team.leads()) w.group_base[g] = with_w(base, 0.0f);
  }
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 row = predicted.of(axis), u = shape.of(axis), m = motion.of(axis);
    const auto own_part = [&](float of_shape, float of_motion) {
      return own_moment(of_prediction, of_shape, of_motion);
    };
    const Float4 moment = {own_part(u.x, m.x) + per_h * (row.x * upper.x + row.y * upper.y + row.z * upper.z),
                           own_part(u.y, m.y) + per_h * (row.x * upper.y + row.y * upper.w + row.z * lower.x),
                           own_part(u.z, m.z) + per_h * (row.x * upper.z + row.y * lower.x + row.z * lower.y),
                           own_part(u.w, m.w) + (row.x * mass.x + row.y * mass.y + row.z * mass.z)};
    w.group_predicted[at] = moment;
    w.group_moments[at] = moment;
  });
  return false;
}

}  // namespace cutproof::gpu::step_detail
