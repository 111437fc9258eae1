// Rest frames of clusters whose members or members' shares have changed (method.md §5).
#pragma once
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Lanes that compute one rest frame.
inline constexpr int kRestTeam = 32;

// T_s and M_s of one cluster, by all lanes of the team, with the weights w = m / n of its present members: T_s = h ·
// (rest_base + rest_offset), with its first member as the base. Sums are relative to the base. A second sum removes
// their error, so that one rounding of the offset is left.
template <class Block>
CUTPROOF_DEVICE void recompute_rest_frame(const Team<Block, kRestTeam>& team, const DeviceView& w, int s) {
  const BodyConstants& body = w.body[w.slot_body[s]];
  const int* const members = w.members + w.slot_begin[s];
  const Coordinates base = coordinates(body, w.node[members[0]]);
  // add(k, w, X / h - base) for the members of this lane.
  struct Member {
    float mass;
    int clusters, node;
  };
  const auto ask = [&](int k) {
    const int p = members[k];
    return Member{w.displacement[p].w, w.membership_count[p], w.node[p]};
  };
  const auto weighted = [&](auto add) {
    team.template each_asked<12>(w.slot_size[s], ask, [&](int k, const Member& member) {
      const Coordinates c = coordinates(body, member.node);
      const Float3 from_base = {static_cast<float>(c.i - base.i), static_cast<float>(c.j - base.j),
                                static_cast<float>(c.k - base.k)};
      add(k, member.mass / static_cast<float>(member.clusters), from_base);
    });
  };
  typename Team<Block, kRestTeam>::template Sums<4> sums;
  weighted([&](int k, float weight, Float3 x) {
    float* const sum = sums.of(k);
    sum[0] += weight * x.x;
    sum[1] += weight * x.y;
    sum[2] += weight * x.z;
    sum[3] += weight;
  });
  const auto total = team.total(sums);
  const float mass = total.v[3];
  const Float3 first = {total.v[0] / mass, total.v[1] / mass, total.v[2] / mass};
  typename Team<Block, kRestTeam>::template Sums<3> off;
  weighted([&](int k, float weight, Float3 x) {
    float* const sum = off.of(k);
    sum[0] += weight * (x.x - first.x);
    sum[1] += weight * (x.y - first.y);
    sum[2] += weight * (x.z - first.z);
  });
  const auto residual = team.total(off);
  if (!team.leads()) return;
  w.mass[s] = mass;
  w.rest_base[3 * s] = base.i;
  w.rest_base[3 * s + 1] = base.j;
  w.rest_base[3 * s + 2] = base.k;
  w.rest_offset[s] = {first.x + residual.v[0] / mass, first.y + residual.v[1] / mass, first.z + residual.v[2] / mass};
  w.rest_dirty[s] = 0;
}

// slots[0 .. *count): a team for each.
template <class Block>
CUTPROOF_DEVICE void recompute_rest_frames_kernel(Block& block, DeviceView w, const int* slots, const int* count) {
  const Team<Block, kRestTeam> team(block);
  for (int64_t job = team.first(); job < *count; job += team.stride()) {
    const int s = slots[job];
    if (w.slot_size[s] > 0) {
      recompute_rest_frame(team, w, s);
    } else if (team.leads()) {
      w.rest_dirty[s] = 0;
    }
  }
}
CUTPROOF_KERNEL(recompute_rest_frames_kernel);

// Every slot whose rest_dirty is set; clears the flags. Uses slot_scratch from 3 · slot_capacity on and
// Counters::scratch[7].
template <class Launcher>
void enqueue_rest_frames(Launcher& launcher, const DeviceView& w) {
  int* const slots = w.slot_scratch + int64_t{3} * w.slot_capacity;
  int* const count = &w.counters->scratch[7];
  launcher.select(w.rest_dirty, w.slot_capacity, slots, count, &w.counters->slots_used);
  launcher.teams(recompute_rest_frames_kernel_object{}, kRestTeam, w.slots_expected, w, static_cast<const int*>(slots),
                 static_cast<const int*>(count));
}

}  // namespace cutproof::gpu
