// A group of particles, its rest position, and a ball that contains it.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/contacts.cuh"
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// A group's data that all of its lanes need.
struct Group {
  int index;
  GroupHead head;
  RestCenter center;
  // X - X_g [h] of its particle k.
  CUTPROOF_DEVICE Float3 offset(const DeviceView& w, const Pace& pace, int k) const {
    return offset_at(pace, constant(&w.place_node[head.begin + k]));
  }
  // X - X_g [h] of the particle at this node.
  CUTPROOF_DEVICE Float3 offset_at(const Pace& pace, int node) const {
    return nodes_between(center, coordinates(pace, node));
  }
};
CUTPROOF_DEVICE inline Group group_of(const DeviceView& w, int g) {
  return {g, constant(&w.group_head[g]), constant(&w.group_center[g])};
}

// Where the prediction, the map and the lost shape put a particle of a carried group. The addition to the prediction is
// small where little has happened, however far the particle is from the base.
CUTPROOF_DEVICE inline Float3 carried_to(Float3 base, float lost, Float3 predicted, const Map& map, Float3 r) {
  return predicted + (map(r) - lost * (predicted - base));
}

// [h] A base farther than this from the mean of its group is not used.
inline constexpr float kFarBase = 1.0f / 16.0f;
// Bounds of lengths are made larger by this part. It exceeds the roundings of their own sums and those of the lengths.
inline constexpr float kPartForRounding = 0x1p-20f;

// A ball that contains the points d~ + M(r) - l e of a group. kept: 1 - l.
CUTPROOF_DEVICE inline Ball ball_around(const Pace& pace, const Group& group, Float4 base, float kept, const Map& map) {
  const RestCenter& center = group.center;
  const RestPoint rest = {pace.h,
                          {static_cast<float>(center.i) + center.x, static_cast<float>(center.j) + center.y,
                           static_cast<float>(center.k) + center.z}};
  const float radius = greatest_stretch(map, pace.h) * group.head.radius + kept * base.w;
  return {rest, xyz(base) + map.moved(), radius};
}

// How far the particles of a group may go from their predictions without touching anything. predicted: a ball about the
// predictions; start: one about where they began the substep. Contacts act on x, which lies between the two.
template <bool kRetarded>
CUTPROOF_DEVICE inline float room_of_prediction(const Pace& pace, const Contacts& contacts, const Ball& start,
                                                Ball predicted, int side) {
  if (!is_retarded<kRetarded>(pace)) return room_around(contacts, predicted, side);
  predicted.d = x_between<kRetarded>(pace, start.d, predicted.d);
  predicted.radius = x_between<kRetarded>(pace, start.radius, predicted.radius) * (1.0f + kPartForRounding);
  return room_around(contacts, predicted, side) / pace.dt_fraction;
}

}  // namespace cutproof::gpu::step_detail
