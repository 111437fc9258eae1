// Shape matching of clusters: the centre and the rotation of each, from the moments of its groups and from its loose
// particles (docs/design/method.md §3).
//
// All positions are displacements from rest, d = x - X. Then t_c - T_c = Σ w d / M. Particle i has its goal in cluster
// c at X_i + β d_i + (1 - β)(t_c - T_c) + (C_c - (1 - β) I)(X_i - T_c), with C_c = R_c where β = 0. So a body at rest,
// or moved as a whole, is reproduced exactly: all d are equal, all moments about bases are zero, and R_c is I to the
// last bit.
#pragma once
#include <cstddef>

#include "gpu/kernels/rotation.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/moments.cuh"
#include "gpu/kernels/volume.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

namespace step_detail {

// Lanes that share a cluster; few clusters have more than 32 groups. In a load of many clusters half of the lanes do
// the work of all, and sum in the same order.
inline constexpr int kClusterTeam = 32, kHalfTeam = 16;
inline constexpr int kMatchThreads = 128;
inline constexpr int kFewClusters = 4096;  // of a load

// Sums over the particles of a cluster about `base`, in the order of GroupSums.
struct ClusterSums {
  Floats<12> moments;
  Float3 base;
};
// Most clusters that a team sums before their rotations are computed. Rotations take too long for few threads of a
// block to compute them while others wait.
template <int kLanes>
inline constexpr int kMostTurns = kLanes == kClusterTeam ? 1 : kMatchThreads / kLanes / 2;
template <int kLanes>
inline constexpr std::size_t kMatchShared = kMostTurns<kLanes>*(kMatchThreads / kLanes) * sizeof(ClusterSums);

// Data of a cluster's lanes that no iteration changes: the first group of each lane that this one stands for, and the
// first loose particle.
template <class AnyTeam>
inline constexpr int kGroupsAhead = AnyTeam::kLanes > 1 ? kClusterTeam / AnyTeam::kLanes : 1;
template <class AnyTeam>
struct ClusterAhead {
  ClusterHead head;
  Offset to[kGroupsAhead<AnyTeam>];
  Float4 mass[kGroupsAhead<AnyTeam>];
  Float3 base[kGroupsAhead<AnyTeam>];
  int loose;
  Pace pace;
  // visit(bank, k) for the groups that this lane has read.
  template <class Visit>
  CUTPROOF_DEVICE void each(const AnyTeam& team, Visit visit) const {
    for (int bank = 0; bank < kGroupsAhead<AnyTeam>; ++bank) {
      const int k = team.lane() + bank * AnyTeam::kLanes;
      if (k < head.group_count) visit(bank, k);
    }
  }
  CUTPROOF_DEVICE void read_bases(const AnyTeam& team, const DeviceView& w) {
    each(team, [&](int bank, int) { base[bank] = xyz(w.group_base[to[bank].index]); });
  }
};
template <class AnyTeam>
CUTPROOF_DEVICE ClusterAhead<AnyTeam> cluster_ahead(const AnyTeam& team, const DeviceView& w, int s,
                                                    const ClusterHead& head) {
  ClusterAhead<AnyTeam> ahead = {};
  ahead.head = head;
  ahead.pace = constant(&w.pace[body_of_slot(w, s)]);
  ahead.each(team, [&](int bank, int k) { ahead.to[bank] = constant(&w.cluster_groups[head.group_begin + k]); });
  ahead.each(team, [&](int bank, int) { ahead.mass[bank] = constant(&w.group_mass[ahead.to[bank].index]); });
  if (team.lane() < head.loose_count) ahead.loose = w.cluster_loose[head.loose_begin + team.lane()];
  return ahead;
}

// Sums over a cluster: its groups, moved to its base and rest centre, and its loose particles.
template <class AnyTeam>
CUTPROOF_DEVICE void sum_cluster(const AnyTeam& team, const DeviceView& w, int s, const ClusterAhead<AnyTeam>& ahead,
                                 ClusterSums& found) {
  const ClusterHead& head = ahead.head;
  const float per_h = ahead.pace.per_h;
  typename AnyTeam::template Sums<12, kClusterTeam> sums;
  const Float3 base =
      head.group_count > 0 ? team.from(0, ahead.base[0]) : xyz(w.position[w.cluster_loose[head.loose_begin]]);
  Moments moments[kGroupsAhead<AnyTeam>];
  ahead.each(team, [&](int bank, int) { moments[bank] = load_moments(w, ahead.to[bank].index); });
  team.each(sums, head.group_count, [&](int k, int bank, float* sum) {
    const int read = bank < kGroupsAhead<AnyTeam> ? bank : 0;
    Offset to = ahead.to[read];
    Float4 mass = ahead.mass[read];
    Float3 from = ahead.base[read];
    Moments of_group = moments[read];
    if (k != team.lane() + read * team.kLanes) {
      to = constant(&w.cluster_groups[head.group_begin + k]);
      mass = constant(&w.group_mass[to.index]);
      from = xyz(w.group_base[to.index]);
      of_group = load_moments(w, to.index);
    }
    const Float3 apart = from - base;
    for (int axis = 0; axis < 3; ++axis) {
      const Float4 own = of_group.row[axis];
      const float moved = own.w + mass.w * apart[axis];
      const float shift = per_h * apart[axis], lever = per_h * moved;
      sum[4 * axis] += own.x + (shift * mass.x + lever * to.x);
      sum[4 * axis + 1] += own.y + (shift * mass.y + lever * to.y);
      sum[4 * axis + 2] += own.z + (shift * mass.z + lever * to.z);
      sum[4 * axis + 3] += moved;
    }
  });
  team.each(sums, head.loose_count, [&](int k, int, float* sum) {
    const int o = k == team.lane() ? ahead.loose : w.cluster_loose[head.loose_begin + k];
    const Float4 now = w.position[o];
    const Float3 e = xyz(now) - base;
    add_moments(sum, now.w, e, per_h * e,
                nodes_from_rest_center(w, coordinates(ahead.pace, constant(&w.place_node[o])), s));
  });
  team.parted(sums).each(team, [&](int n, float sum) { found.moments.v[n] = sum; });
  if (team.leads()) found.base = base;
}

// Further data that decides a cluster's place.
struct ClusterRest {
  Float4 row[3];  // DeviceView::cluster_rest
  Start<float> start;
  float h, per_mass, per_mass_and_h;
  int size;
  float volume_share;  // where clusters keep their volume
};
template <bool kVolume>
CUTPROOF_DEVICE inline ClusterRest rest_of_cluster(const DeviceView& w, int s) {
  const Float4* const row = w.cluster_rest + 3 * int64_t{s};
  ClusterRest rest = {};
  for (int k = 0; k < 3; ++k) rest.row[k] = constant(&row[k]);
  rest.start = start_from(w.rotation[s]);
  rest.h = constant(&w.pace[body_of_slot(w, s)]).h;
  rest.per_mass = 1.0f / rest.row[0].w;
  rest.per_mass_and_h = 1.0f / (rest.row[0].w * rest.h);
  rest.size = w.slot_size[s];
  if constexpr (kVolume) rest.volume_share = w.body[w.slot_body[s]].volume_share;
  return rest;
}

// Stores centre, rotation and map of a cluster, which follow from its sums.
template <bool kVolume>
CUTPROOF_DEVICE inline void place_cluster(const DeviceView& w, int s, const ClusterRest& rest,
                                          const ClusterSums& sums) {
  const float* const moment = sums.moments.v;
  const Float4 first = rest.row[0], second = rest.row[1], third = rest.row[2];
  const Float3 rest_moment = xyz(first), moved = {moment[3], moment[7], moment[11]};
  const float spread[9] = {second.x, second.y, second.z, second.y, second.w, third.x, second.z, third.x, third.y};
  // A = Σ w (x - t)(X - T)ᵀ / h². The rest moment is the rounding of T.
  const Float3 shift = rest.per_mass_and_h * moved;
  Matrix3 a;
  [[maybe_unused]] Matrix3 change;  // A - A0
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      change(row, k) = moment[4 * row + k] - shift[row] * rest_moment[k];
      a(row, k) = spread[3 * row + k] + change(row, k);
    }
  }
  // One particle has no extent: A is only rounding, and rotate() would make a rotation of it.
  const Matrix3& previous = w.rotation[s];
  const Rotation<float> best = rest.size > 1 ? rotate(a, previous, rest.start) : Rotation<float>{previous, true};
  // The centre makes Σ w (goal) equal Σ w x to the rounding of these two sums: the rounded T must not push the
  // cluster (docs/design/decisions.md, Momentum and the rounding of sums).
  Float3 turned = best.r * rest_moment - rest_moment;
  Matrix3 map;  // C - (1 - β) I
  for (int k = 0; k < 9; ++k) map.m[k] = best.r.m[k] - (k % 4 == 0 ? 1.0f : 0.0f);
  if constexpr (kVolume) {
    if (rest.volume_share > 0 && rest.size > 1) {
      const float a0[3][3] = {
          {spread[0], spread[1], spread[2]}, {spread[3], spread[4], spread[5]}, {spread[6], spread[7], spread[8]}};
      map = map_towards(rest.volume_share, volume_maps(a0, change, best.r).pull, best.r);
      turned = (1.0f / (1.0f - rest.volume_share)) * (map * rest_moment);
    }
  }
  const Float3 center = sums.base + rest.per_mass * (moved - rest.h * turned);
  for (int axis = 0; axis < 3; ++axis) {
    w.placement[3 * int64_t{s} + axis] = {map(axis, 0), map(axis, 1), map(axis, 2), center[axis]};
  }
  w.rotation[s] = best.r;
  w.degenerate[s] = best.degenerate;
}

}  // namespace step_detail

// Places all clusters. On the device the teams of a block sum. In a load of many clusters each team sums several, and
// neighbouring threads then compute their rotations side by side. In a load of few the first thread of each team
// computes one, without waiting for other teams.
template <int kLanes, bool kVolume, class Block>
CUTPROOF_DEVICE void match_shapes_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int slots = w.counters->slots_used;
  const auto wanted = [&](int64_t s, ClusterHead& head) {
    if (s >= slots) return false;
    head = constant(&w.cluster_head[s]);
    return head.group_count + head.loose_count > 0 &&
           takes_part(constant(&w.pace[body_of_slot(w, static_cast<int>(s))]), substep, iteration);
  };
  if constexpr (Block::on_device) {
    constexpr int kTeams = kMatchThreads / kLanes;
    constexpr int kMost = kMostTurns<kLanes>;
    constexpr bool apart = kLanes == kClusterTeam;
    ClusterSums* const all = block.template shared<ClusterSums>(kMost * kTeams);
    const int mine = block.thread() / kLanes;
    const int which = apart ? mine : block.thread();  // in its block: the cluster that this thread may place
    int turns = 1;
    while (turns < kMost && turns * kTeams * block.count() < slots) ++turns;
    for (int64_t begin = static_cast<int64_t>(block.index()) * turns * kTeams; begin < slots;
         begin += static_cast<int64_t>(block.count()) * turns * kTeams) {
      const int placed = static_cast<int>(begin) + which;
      ClusterHead ignored;
      bool places = false;
      ClusterRest rest = {};
      for (int turn = 0; turn < turns; ++turn) {
        const int summed = static_cast<int>(begin) + turn * kTeams + mine;
        ClusterHead head = {};
        const bool sums = wanted(summed, head);
        ClusterAhead<Team<Block, kLanes>> ahead = {};
        if (sums) ahead = cluster_ahead(team, w, summed, head);
        // Bases are written when a substep begins, so all its iterations but the first read them ahead.
        if (sums && iteration > 0) ahead.read_bases(team, w);
        if (turn == 0) {
          places = apart ? sums && team.leads() : which < turns * kTeams && wanted(placed, ignored);
          // (Where few threads place many clusters, it would take registers from all threads that sum.)
          if (apart && places) rest = rest_of_cluster<kVolume>(w, placed);
        }
        block.wait_for_earlier();
        if (!sums) continue;
        if (iteration == 0) ahead.read_bases(team, w);
        sum_cluster(team, w, summed, ahead, all[turn * kTeams + mine]);
      }
      apart ? team.sync() : block.sync();
      if (!apart && places) rest = rest_of_cluster<kVolume>(w, placed);
      if (places) place_cluster<kVolume>(w, placed, rest, all[which]);
      apart ? team.sync() : block.sync();
    }
  } else {
    for (int64_t i = team.first(); i < slots; i += team.stride()) {
      const int s = static_cast<int>(i);
      ClusterHead head = {};
      if (!wanted(s, head)) continue;
      ClusterAhead<Team<Block, kLanes>> ahead = cluster_ahead(team, w, s, head);
      ahead.read_bases(team, w);
      ClusterSums sums;
      sum_cluster(team, w, s, ahead, sums);
      place_cluster<kVolume>(w, s, rest_of_cluster<kVolume>(w, s), sums);
    }
  }
  block.wait_for_earlier();
  if (block.first() == 0) {
    *resolved_before(w, substep, iteration + 1) = *resolved_before(w, substep, iteration);
    *resolved_before(w, substep + 1, 0) = 0;
  }
}

template <int kLanes, bool kVolume>
struct match_shapes_kernel_object {
  static constexpr const char* kName = "match_shapes_kernel";
  static constexpr bool kReadsAhead = true;
  static constexpr int kMaxThreads = step_detail::kMatchThreads, kMinBlocks = 4;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    match_shapes_kernel<kLanes, kVolume>(block, w, substep, iteration);
  }
};

}  // namespace cutproof::gpu
