// The mean goal of a group: the mean of the affine maps by which its holders would move it.
#pragma once
#include "gpu/kernels/step/affine_map.cuh"
#include "gpu/kernels/step/group.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Several holders of a group. They do not change in a substep.
template <int kAtOnce>
struct SomeHolders {
  Offset to[kAtOnce];
};
template <int kAtOnce>
CUTPROOF_DEVICE inline SomeHolders<kAtOnce> holders_from(const DeviceView& w, const GroupHead& head, int begin) {
  SomeHolders<kAtOnce> holders;
  for (int k = 0; k < kAtOnce; ++k) {
    holders.to[k] = constant(&w.holders[head.holder_begin + begin + (begin + k < head.holder_count ? k : 0)]);
  }
  return holders;
}

// A group's data that does not change in a substep.
template <int kAtOnce>
struct GroupAhead {
  Group group;
  SomeHolders<kAtOnce> holders;
  Float4 base;
};
template <int kAtOnce>
CUTPROOF_DEVICE inline GroupAhead<kAtOnce> group_ahead(const DeviceView& w, int g) {
  const Group group = group_of(w, g);
  return {group, holders_from<kAtOnce>(w, group.head, 0), w.group_base[g]};
}
// How many holders are read at once. Where lanes share a group, registers suffice for all holders of most groups, and
// for everything else that is read ahead.
template <int kRows>
inline constexpr int kHoldersAtOnce = kRows > 1 ? 8 : 4;

// The mean goal of a group's particle at x is base + β (x - base) + goal(r). Returns `goal`, each row in the lane that
// has its axis.
template <int kAtOnce, class AnyTeam>
CUTPROOF_DEVICE inline Rows<AnyTeam> mean_goal(const AnyTeam& team, const DeviceView& w, const GroupHead& head,
                                               SomeHolders<kAtOnce> some, const Pace& pace, Float4 base) {
  const float h = pace.h, of_centers = 1.0f - pace.volume_share;
  Rows<AnyTeam> goal;
  const auto add = [&](int begin) {
    // Several are read at once, along all axes: one by one, each would wait for the previous one.
    Rows<AnyTeam> row[kAtOnce];
    for (int k = 0; k < kAtOnce; ++k) {
      team.each(3, [&](int axis) { row[k].of(axis) = w.placement[3 * int64_t{some.to[k].index} + axis]; });
    }
    team.each(3, [&](int axis) {
      const float from = xyz(base)[axis];
      Float4& sum = goal.of(axis);
      for (int k = 0; k < kAtOnce; ++k) {
        if (begin + k >= head.holder_count) break;
        const Offset to = some.to[k];
        const Float4 of = row[k].of(axis);
        sum.x += of.x;
        sum.y += of.y;
        sum.z += of.z;
        sum.w += of_centers * (of.w - from) + h * (of.x * to.x + of.y * to.y + of.z * to.z);
      }
    });
  };
  add(0);
  CUTPROOF_ROLLED
  for (int begin = kAtOnce; begin < head.holder_count; begin += kAtOnce) {
    some = holders_from<kAtOnce>(w, head, begin);
    add(begin);
  }
  const float mean = 1.0f / static_cast<float>(head.holder_count), turn = h * mean;
  team.each(3, [&](int axis) {
    Float4& sum = goal.of(axis);
    sum = {turn * sum.x, turn * sum.y, turn * sum.z, mean * sum.w};
  });
  return goal;
}

}  // namespace cutproof::gpu::step_detail
