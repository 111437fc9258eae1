// An iteration of a carried group advances its map instead of its particles. An iteration of a held group: its map has
// the push of the grip.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/goals.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Advances a group that has been carried so far by an iteration. If it may touch a contact in this iteration, returns
// true and changes nothing.
template <bool kContacts, bool kAccelerated, bool kRetarded, class Block, int kRows>
CUTPROOF_DEVICE bool advance_carried(Block& block, const Team<Block, kRows>& team, const DeviceView& w, int g,
                                     int substep, int iteration) {
  const GroupAhead<kHoldersAtOnce<kRows>> ahead = group_ahead<kHoldersAtOnce<kRows>>(w, g);
  const GroupHead& head = ahead.group.head;
  const Float4 base = ahead.base;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  [[maybe_unused]] float room = 0;
  [[maybe_unused]] int state = kCarried;
  if constexpr (kContacts) state = w.group_resolved[g];
  // In this order: a group of a body that takes no part may have no state.
  const bool active = head.size > 0 && takes_part(pace, substep, iteration) && state != kResolved;
  const bool more = iteration + 1 < pace.iterations;
  if constexpr (kContacts) {
    if (active && state == kCarried) room = w.group_room[g];
  }
  Iteration now = {};
  if (active) now = iteration_of(w, body, pace, iteration);
  Rows<Team<Block, kRows>> present, earlier, of_prediction;
  Float4 mass, upper, lower;
  const auto read_maps = [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    if (iteration > 0) earlier.of(axis) = present.of(axis) = w.group_map[at];
    // The map before the first iteration has no weight.
    if constexpr (kAccelerated) {
      if (iteration > 1 && now.combined) earlier.of(axis) = w.group_earlier_map[at];
    }
  };
  const auto read_moments = [&] {
    mass = constant(&w.group_mass[g]);
    upper = constant(&w.group_spread[2 * int64_t{g}]);
    lower = constant(&w.group_spread[2 * int64_t{g} + 1]);
    if (more) team.each(3, [&](int axis) { of_prediction.of(axis) = w.group_predicted[3 * int64_t{g} + axis]; });
  };
  constexpr bool kAllAhead = kRows > 1;  // a single thread lacks registers for this
  if constexpr (kAllAhead) {
    if (active) {
      team.each(3, read_maps);
      if (state == kCarried) read_moments();  // a held group needs none
    }
  }
  block.wait_for_earlier();  // for the clusters; all other data is older
  if (!active) return false;
  const float lost_next = now.lost_after;
  Rows<Team<Block, kRows>> goals = mean_goal(team, w, head, ahead.holders, pace, base), plain, next;
  if constexpr (!kAllAhead) team.each(3, read_maps);
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 goal = goals.of(axis);
    if constexpr (kContacts) {
      if (state == kHeld) {
        // The recurrence of set_held_push().
        const float push_factor = now.implicit ? now.s : 1.0f,
                    added = now.combined ? now.combination.pull * now.s : now.s;
        const auto plain_push = [&](float of_goal, float is) { return push_factor * is + added * of_goal; };
        Float4 row = row_of(plain_push, goal, present.of(axis));
        if constexpr (kAccelerated) {
          if (now.combined) {
            const Float4 push = present.of(axis), earlier_push = earlier.of(axis);
            const auto combined_push = [&](float is, float was, float of_goal) {
              return now.combination(push_factor * is, is, was) + added * of_goal;
            };
            row = {combined_push(push.x, earlier_push.x, goal.x), combined_push(push.y, earlier_push.y, goal.y),
                   combined_push(push.z, earlier_push.z, goal.z), combined_push(push.w, earlier_push.w, goal.w)};
          }
          if (now.keeps) w.group_earlier_map[at] = present.of(axis);
        }
        w.group_map[at] = row;
        return;
      }
    }
    const auto relaxed = [&](float wanted, float is) { return now.own * is + now.s * wanted; };
    plain.of(axis) = row_of(relaxed, goal, present.of(axis));
    next.of(axis) = plain.of(axis);
    if constexpr (kAccelerated) {
      if (!now.combined) return;
      const Float4 wanted = plain.of(axis), is = present.of(axis), was = earlier.of(axis);
      next.of(axis) = {now.combination(wanted.x, is.x, was.x), now.combination(wanted.y, is.y, was.y),
                       now.combination(wanted.z, is.z, was.z), now.combination(wanted.w, is.w, was.w)};
    }
  });
  if constexpr (kContacts) {
    if (state == kHeld) return false;
    // A contact with either candidate of an accelerated iteration means the plain iterate. Most groups are so far from
    // any contact that the ways along each axis suffice.
    bool near = false;
    team.each(3, [&](int axis) {
      near = near || !(way_along(plain.of(axis), head.radius) <= kPartOfRoom * room) ||
             (now.combined && !(way_along(next.of(axis), head.radius) <= kPartOfRoom * room));
    });
    // (With retardation contacts act on x, between y and the start of the substep, which is not at hand. So the group
    // is resolved, which is always right.)
    if (team.any(near)) {
      if (is_retarded<kRetarded>(pace)) return true;
      const Contacts contacts = contacts_of(w, pace, substep);
      const int side = w.group_side[g];
      CUTPROOF_ROLLED
      for (int k = 0; k < (now.combined ? 2 : 1); ++k) {
        Rows<Team<Block, kRows>> candidate = k == 0 ? plain : next;
        const Ball ball = ball_around(pace, ahead.group, base, fabsf(1.0f - lost_next), candidate.all(team));
        if (!is_clear(contacts, ball, side)) return true;
      }
    }
  }
  const float per_h = pace.per_h;
  // Everything is read before anything is written: behind a store, each read would be waited for by itself.
  if constexpr (!kAllAhead) read_moments();
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 row = next.of(axis);
    w.group_map[at] = row;
    if constexpr (kAccelerated) {
      if (now.keeps) w.group_earlier_map[at] = present.of(axis);
    }
    if (!more) return;
    const Float4 predicted = of_prediction.of(axis);
    const auto moved = [&](float at_first, float by_map) { return at_first + (by_map - lost_next * at_first); };
    w.group_moments[at] = {
        moved(predicted.x, per_h * (row.w * mass.x + (row.x * upper.x + row.y * upper.y + row.z * upper.z))),
        moved(predicted.y, per_h * (row.w * mass.y + (row.x * upper.y + row.y * upper.w + row.z * lower.x))),
        moved(predicted.z, per_h * (row.w * mass.z + (row.x * upper.z + row.y * lower.x + row.z * lower.y))),
        moved(predicted.w, row.w * mass.w + (row.x * mass.x + row.y * mass.y + row.z * mass.z))};
  });
  return false;
}

}  // namespace cutproof::gpu::step_detail
