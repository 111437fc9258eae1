// The constants of groups and clusters for sums over groups: rest centres, moments of masses, and the offsets between
// the centres.
#pragma once
#include "gpu/kernels/step/make_groups.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

// Lanes that measure a group.
inline constexpr int kGroupTeam = 8;

namespace groups_detail {

// X_g - T_s [h]: an exact difference of grid coordinates, and one of offsets.
CUTPROOF_DEVICE inline Offset offset_between(RestCenter group, RestCenter cluster, int index) {
  return {static_cast<float>(group.i - cluster.i) + (group.x - cluster.x),
          static_cast<float>(group.j - cluster.j) + (group.y - cluster.y),
          static_cast<float>(group.k - cluster.k) + (group.z - cluster.z), index};
}

// Adds one particle to sums of masses about a point, in nodes: first moments, mass, second moments (xx xy xz yy yz zz).
CUTPROOF_DEVICE inline void add_masses(float* sum, float m, Float3 r) {
  sum[0] += m * r.x;
  sum[1] += m * r.y;
  sum[2] += m * r.z;
  sum[3] += m;
  sum[4] += m * (r.x * r.x);
  sum[5] += m * (r.x * r.y);
  sum[6] += m * (r.x * r.z);
  sum[7] += m * (r.y * r.y);
  sum[8] += m * (r.y * r.z);
  sum[9] += m * (r.z * r.z);
}

}  // namespace groups_detail

// Computes X_g, the moments of the masses about it, and its offsets from the rest centres of its holders.
template <class Block>
CUTPROOF_DEVICE void measure_groups_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  using Lanes = Team<Block, kGroupTeam>;
  const Lanes team(block);
  // A lane reads its particles once.
  constexpr int kEach = kMostInGroup / Lanes::kLanes;
  struct Own {
    Coordinates node;
    float mass;  // the share of each holder
  };
  for (int64_t i = w.counters->groups_before + team.first(); i < w.counters->groups; i += team.stride()) {
    const int g = static_cast<int>(i);
    GroupHead head = w.group_head[g];
    const int first = w.place_particle[head.begin];
    const BodyConstants& body = w.body[head.body];
    const float per_holder = 1.0f / static_cast<float>(head.holder_count);
    Own own[kEach];
    const auto each = [&](auto visit) {  // visit(k, own)
      for (int n = 0; n < kEach; ++n) {
        const int k = n * team.kLanes + team.lane();
        if (k < head.size) visit(k, own[n]);
      }
    };
    each([&](int k, Own& of) {
      of.node = coordinates(body, w.place_node[head.begin + k]);
      of.mass = per_holder * w.displacement[w.place_particle[head.begin + k]].w;
    });
    const Coordinates base = coordinates(body, w.place_node[head.begin]);
    RestCenter center = {base.i, base.j, base.k, 0, 0, 0};
    // The second round removes the error of the first centre.
    for (int round = 0; round < 2; ++round) {
      typename Lanes::template Sums<4> sums;
      each([&](int k, const Own& of) {
        const Float3 r = nodes_between(center, of.node);
        float* const sum = sums.of(k);
        sum[0] += of.mass * r.x;
        sum[1] += of.mass * r.y;
        sum[2] += of.mass * r.z;
        sum[3] += of.mass;
      });
      const auto total = team.total(sums);
      center.x += total.v[0] / total.v[3];
      center.y += total.v[1] / total.v[3];
      center.z += total.v[2] / total.v[3];
    }
    typename Lanes::template Sums<10> sums;
    float farthest = 0, nearest = -INFINITY;  // nearest: minus the square of the least distance
    each([&](int k, const Own& of) {
      const Float3 r = nodes_between(center, of.node);
      add_masses(sums.of(k), of.mass, r);
      farthest = fmaxf(farthest, dot(r, r));
      nearest = fmaxf(nearest, -dot(r, r));
    });
    const auto total = team.total(sums);
    farthest = team.greatest(farthest);
    nearest = team.greatest(nearest);
    int middle = head.size;  // the first of the nearest particles
    each([&](int k, const Own& of) {
      const Float3 r = nodes_between(center, of.node);
      if (-dot(r, r) == nearest && k < middle) middle = k;
    });
    head.middle = -static_cast<int>(team.greatest(-static_cast<float>(middle)));
    head.radius = sqrtf(farthest) * (1.0f + 0x1p-20f);
    if (team.leads()) {
      w.group_head[g] = head;
      w.group_center[g] = center;
      w.group_mass[g] = {total.v[0], total.v[1], total.v[2], total.v[3]};
      w.group_spread[2 * i] = {total.v[4], total.v[5], total.v[6], total.v[7]};
      w.group_spread[2 * i + 1] = {total.v[8], total.v[9], 0, 0};
    }
    const HolderList list = holders_of(w, first);
    team.each(list.size, [&](int k) {
      w.holders[head.holder_begin + k] = offset_between(center, rest_center(w, list.begin[k]), list.begin[k]);
    });
  }
}
CUTPROOF_KERNEL(measure_groups_kernel);

// Lists the groups and the loose particles of each cluster, and computes the moments of its members about its rest
// centre. That centre may have moved, so groups that stay get new offsets from it.
template <class Block>
CUTPROOF_DEVICE void measure_clusters_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  const Team<Block, kMemberTeam> team(block);
  Counters& counters = *w.counters;
  const bool whole = block.load(&counters.groups_whole) != 0;
  const int clusters = whole ? counters.slots_used : counters.remeasured;
  for (int64_t i = team.first(); i < clusters; i += team.stride()) {
    const int s = whole ? static_cast<int>(i) : remeasured(w)[i], size = w.slot_size[s];
    if (team.leads()) w.regroup[s] = 0;
    if (size == 0) {
      if (team.leads()) w.cluster_head[s] = {};
      continue;
    }
    const BodyConstants& body = w.body[w.slot_body[s]];
    const RestCenter center = rest_center(w, s);
    const int* const members = w.members + w.slot_begin[s];
    // A list of groups has a quarter of the members' capacity, because a group has at least kLeastInGroup of them.
    const int list_begin = (w.slot_begin[s] + kLeastInGroup - 1) / kLeastInGroup;
    int groups = 0, loose = 0;
    typename Team<Block, kMemberTeam>::template Sums<10> sums;
    // Several tiles are read at once: each step waits for the reads of the previous one.
    constexpr int kReadAtOnce = 6;
    for (int tile = 0; tile < size; tile += kReadAtOnce * team.kLanes) {
      int member[kReadAtOnce], at[kReadAtOnce], node[kReadAtOnce], holder_count[kReadAtOnce], place[kReadAtOnce];
      float mass[kReadAtOnce];
      for (int t = 0; t < kReadAtOnce; ++t) {
        const int k = tile + t * team.kLanes + team.lane();
        member[t] = members[k < size ? k : 0];
      }
      for (int t = 0; t < kReadAtOnce; ++t) {
        const int p = member[t];
        at[t] = tile + t * team.kLanes + team.lane() < size ? w.group_at[p] : int{kInside};
        node[t] = w.node[p];
        mass[t] = w.displacement[p].w;
        holder_count[t] = w.membership_count[p];
        place[t] = w.place_of[p];
      }
      Offset to[kReadAtOnce];
      for (int t = 0; t < kReadAtOnce; ++t) {
        if (at[t] >= 0) to[t] = offset_between(w.group_center[at[t]], center, at[t]);
      }
      for (int t = 0; t < kReadAtOnce; ++t) {
        const int k = tile + t * team.kLanes + team.lane();
        if (k < size) {
          const Float3 r = nodes_between(center, coordinates(body, node[t]));
          add_masses(sums.of(k), mass[t] / static_cast<float>(holder_count[t]), r);
        }
        int found = 0;
        const int before = team.rank(at[t] == kLoose, found);
        if (at[t] == kLoose) w.cluster_loose[w.slot_begin[s] + loose + before] = place[t];
        loose += found;
        const int group = groups + team.rank(at[t] >= 0, found);
        groups += found;
        if (at[t] >= 0) w.cluster_groups[list_begin + group] = to[t];
      }
    }
    // Groups that stay get new offsets; new groups have them.
    team.sync();  // all lanes read the list
    team.each(groups, [&](int k) {
      const Offset to = w.cluster_groups[list_begin + k];
      if (to.index >= counters.groups_before) return;
      const GroupHead head = w.group_head[to.index];
      const int end = head.holder_begin + head.holder_count;
      for (int first = head.holder_begin; first < end; first += kReadAtOnce) {
        int index[kReadAtOnce];
        for (int j = 0; j < kReadAtOnce; ++j) index[j] = w.holders[first + j < end ? first + j : first].index;
        for (int j = 0; j < kReadAtOnce; ++j) {
          if (index[j] == s && first + j < end) w.holders[first + j] = {to.x, to.y, to.z, s};
        }
      }
    });
    const auto total = team.total(sums);
    if (!team.leads()) continue;
    w.cluster_head[s] = {list_begin, groups, w.slot_begin[s], loose};
    w.cluster_rest[3 * int64_t{s}] = {total.v[0], total.v[1], total.v[2], total.v[3]};
    w.cluster_rest[3 * int64_t{s} + 1] = {total.v[4], total.v[5], total.v[6], total.v[7]};
    w.cluster_rest[3 * int64_t{s} + 2] = {total.v[8], total.v[9], 0, 0};
  }
}
CUTPROOF_KERNEL(measure_clusters_kernel);

}  // namespace cutproof::gpu
