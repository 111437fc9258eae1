// Moments of a group: the sums over its particles of w e and w e rᵀ / h. Here e is the distance from a base, and w is
// the share of a particle's mass that each holder gets.
#pragma once
#include "gpu/kernels/step/group.cuh"
#include "gpu/kernels/step/work.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// Weighted sums in the order of arrays.inc. Sum 4 axis + k is of e rᵀ / h, and sum 4 axis + 3 of e. kOrder: as in
// Team::Sums.
template <class AnyTeam, int kOrder>
using GroupSums = typename AnyTeam::template Sums<12, kOrder>;

// Adds one particle to sums in the order of GroupSums.
CUTPROOF_DEVICE inline void add_moments(float* sums, float weight, Float3 e, Float3 e_per_h, Float3 r) {
  for (int axis = 0; axis < 3; ++axis) {
    const float mass_e_per_h = weight * e_per_h[axis];
    sums[4 * axis] += mass_e_per_h * r.x;
    sums[4 * axis + 1] += mass_e_per_h * r.y;
    sums[4 * axis + 2] += mass_e_per_h * r.z;
    sums[4 * axis + 3] += weight * e[axis];
  }
}
// Stores sum n of group g.
CUTPROOF_DEVICE inline void store_moment(Float4* rows, int g, int n, float sum) {
  Float4& row = rows[3 * int64_t{g} + n / 4];
  (n % 4 == 0 ? row.x : n % 4 == 1 ? row.y : n % 4 == 2 ? row.z : row.w) = sum;
}

struct Moments {
  Float4 row[3];
};
CUTPROOF_DEVICE inline Moments load_moments(const DeviceView& w, int g) {
  const Float4* const row = w.group_moments + 3 * int64_t{g};
  return {{row[0], row[1], row[2]}};
}

// Sums the moments of the values of a group's particles; value(k) has a weight in w. The base is the value of the
// middle particle, or the group's mean if that value is farther than `far` from it. (Not always the mean: moments must
// vanish where the group moves as a whole.) Returns the base, and in w a bound of the greatest distance from it.
template <int kOrder, class AnyTeam, class Value>
CUTPROOF_DEVICE Float4 sum_about(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                 float per_mass, float far, Value value, typename AnyTeam::template Parted<12>& total) {
  const GroupHead& head = group.head;
  Float3 base;
  if (team.has(head.middle)) base = xyz(value(head.middle));
  base = team.from(head.middle, base);
  float reach = 0;
  for (int round = 0;; ++round) {
    GroupSums<AnyTeam, kOrder> sums;
    reach = 0;
    team.each(sums, head.size, [&](int k, int, float* sum) {
      const Float4 particle = value(k);
      const Float3 e = xyz(particle) - base;
      reach = fmaxf(reach, dot(e, e));
      add_moments(sum, particle.w, e, pace.per_h * e, group.offset(w, pace, k));
    });
    total = team.parted(sums);
    const Float3 off = {per_mass * total.get(team, 3), per_mass * total.get(team, 7), per_mass * total.get(team, 11)};
    if (round > 0 || !(dot(off, off) > far * far)) break;
    base = base + off;
  }
  return with_w(base, sqrtf(team.greatest(reach)) * (1.0f + kPartForRounding));
}

// The moments of a resolved group, from the positions of its particles. They are summed once all have moved: sums and
// projections together would need too many registers. own: position and mass of this lane's first particle, usually its
// only one. (Reading back what was just written would cost a wait.)
template <class AnyTeam>
CUTPROOF_DEVICE void sum_resolved(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                  Float3 base, Float4 own) {
  const float per_holder = 1.0f / static_cast<float>(group.head.holder_count), per_h = pace.per_h;
  GroupSums<AnyTeam, kResolvedTeam> sums;
  team.each(sums, group.head.size, [&](int k, int, float* sum) {
    const int o = group.head.begin + k;
    const Float4 at = k == team.lane() ? own : with_w(xyz(w.position[o]), w.start[o].w);
    const Float3 e = xyz(at) - base;
    add_moments(sum, per_holder * at.w, e, per_h * e, group.offset(w, pace, k));
  });
  team.parted(sums).each(team, [&](int n, float sum) { store_moment(w.group_moments, group.index, n, sum); });
}

}  // namespace cutproof::gpu::step_detail
