// Iterations of resolved groups: their particles move one by one from the first possible contact to the end of the
// substep.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/goals.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/moments.cuh"
#include "gpu/kernels/step/particle.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/kernels/step/untouched.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Resolves a group that has been carried so far. Its particles get the positions to which its map has brought them and,
// if accelerated, those of one iteration ago. No contact has displaced them yet.
template <bool kAccelerated, bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void resolve(Block& block, const AnyTeam& team, const DeviceView& w, const Group& group,
                             const Pace& pace, const Contacts& contacts, const Iteration& now, Float3 base, int substep,
                             int iteration) {
  const int g = group.index;
  if (!team.any(w.group_tracked[g] != kUntouched)) {
    track_particles(team, w, group, pace, contacts, false, substep);
    list_tracked(block, team, w, g, substep, w.counters->tracked[substep % 2]);
  }
  Map is = {}, was = {};
  if (iteration > 0) is = load_map(w.group_map, g);
  if constexpr (kAccelerated) was = iteration > 1 && now.combined ? load_map(w.group_earlier_map, g) : is;
  const float lost = now.lost_before;
  [[maybe_unused]] float lost_earlier = 0;
  if constexpr (kAccelerated) {
    if (iteration > 0) {
      lost_earlier = constant(numbers_of(w, body_of_group(w, group.head), iteration - 1)).lost_before;
    }
  }
  team.each(group.head.size, [&](int k) {
    const int o = group.head.begin + k;
    const Float3 predicted = xyz(w.predicted[o]), r = group.offset(w, pace, k);
    const Float3 y = carried_to(base, lost, predicted, is, r);
    w.position[o] = with_w(y, 0.0f);
    if (is_retarded<kRetarded>(pace)) w.place[o] = with_w(x_between<kRetarded>(pace, xyz(w.start[o]), y), 0.0f);
    w.pushed[o] = Float4{};
    if constexpr (kAccelerated) {
      w.earlier[o] = with_w(carried_to(base, lost_earlier, predicted, was, r), 0.0f);
      w.pushed_earlier[o] = Float4{};
    }
  });
  list_resolved(block, team, w, pace, g, substep, iteration + 1);
}

// Advances the particles of a resolved group by an iteration. begins: it has been carried so far.
template <bool kContacts, bool kAccelerated, bool kRetarded, class Block, class AnyTeam, int kAtOnce>
CUTPROOF_DEVICE void advance_resolved(Block& block, const AnyTeam& team, const DeviceView& w,
                                      const GroupAhead<kAtOnce>& ahead, int substep, int iteration, bool begins) {
  const Group& group = ahead.group;
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (!takes_part(pace, substep, iteration)) return;
  const Contacts contacts = contacts_of(w, pace, substep);
  const Iteration now = iteration_of(w, body, pace, iteration);
  const Float3 base = xyz(ahead.base);
  if (begins) resolve<kAccelerated, kRetarded>(block, team, w, group, pace, contacts, now, base, substep, iteration);
  const int first = team.lane();  // of this lane's particles
  Particle of_first;
  if (first < head.size) of_first = particle_at<kContacts, kAccelerated>(w, now, head.begin + first);
  block.wait_for_earlier();  // for the clusters; all other data is older
  const Map goal = mean_goal(team, w, head, ahead.holders, pace, ahead.base).all(team);
  Float4 first_at;
  team.each(head.size, [&](int k) {
    const int o = head.begin + k;
    const Particle particle = k == first ? of_first : particle_at<kContacts, kAccelerated>(w, now, o);
    const Float3 from = now.implicit ? xyz(particle.predicted) : xyz(particle.at);
    const Float3 own = pace.volume_share * (xyz(particle.at) - base);
    const Float3 pull = (base - from) + (own + goal(group.offset_at(pace, particle.node)));
    const Float3 y =
        advance_particle<kContacts, kAccelerated, kRetarded>(w, pace, contacts, now, o, particle, from, pull);
    if (k == first) first_at = with_w(y, particle.start.w);
  });
  sum_resolved(team, w, group, pace, base, first_at);
}

}  // namespace cutproof::gpu::step_detail
