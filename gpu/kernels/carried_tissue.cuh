// Where clusters carry points at and beside their particles (docs/design/method.md §4 and §8). Detection and skin use
// it to measure how far tissue is from the blade that separates it.
#pragma once
#include <type_traits>

#include "gpu/kernels/volume.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

inline constexpr int kCenterTeam = 32;  // lanes that find a cluster's centre

// Only these instances contain code for volume: a load without pays nothing.
template <class Start>
void by_volume(bool keeps_volume, Start start) {
  if (keeps_volume) {
    start(std::true_type{});
  } else {
    start(std::false_type{});
  }
}

// DeviceView::center of a cluster from the present displacements, and its member_map and beside_map.
template <bool kVolume, class Block>
CUTPROOF_DEVICE void recenter(const DeviceView& w, const Team<Block, kCenterTeam>& team, int s) {
  const BodyConstants& body = w.body[w.slot_body[s]];
  const int* const members = w.members + w.slot_begin[s];
  const Float3 base = xyz(w.displacement[members[0]]);
  // Σ w (d - base), Σ w (X - T) (the rounding of T), and Σ w.
  typename Team<Block, kCenterTeam>::template Sums<7> sums;
  struct Member {
    Float4 now;
    int clusters, node;
  };
  const auto ask = [&](int k) {
    const int p = members[k];
    return Member{w.displacement[p], w.membership_count[p], w.node[p]};
  };
  const RestCenter center = rest_center(w, s);
  team.template each_asked<8>(w.slot_size[s], ask, [&](int k, const Member& member) {
    const float weight = member.now.w / static_cast<float>(member.clusters);
    const Float3 moved = weight * (xyz(member.now) - base);
    const Float3 rest = weight * (body.h * nodes_between(center, coordinates(body, member.node)));
    float* const sum = sums.of(k);
    sum[0] += moved.x;
    sum[1] += moved.y;
    sum[2] += moved.z;
    sum[3] += rest.x;
    sum[4] += rest.y;
    sum[5] += rest.z;
    sum[6] += weight;
  });
  const auto total = team.total(sums);
  const Float3 moved = {total.v[0], total.v[1], total.v[2]}, rest = {total.v[3], total.v[4], total.v[5]};
  // The rounded T must not move the cluster (docs/design/decisions.md, Momentum and the rounding of sums).
  Float3 turned;
  if constexpr (kVolume) {
    typename Team<Block, kCenterTeam>::template Sums<15> products;  // Σ w (d - base) rᵀ and Σ w r rᵀ, r in nodes
    team.template each_asked<8>(w.slot_size[s], ask, [&](int k, const Member& member) {
      const float weight = member.now.w / static_cast<float>(member.clusters);
      const Float3 d = weight * (xyz(member.now) - base), r = nodes_between(center, coordinates(body, member.node));
      float* const sum = products.of(k);
      for (int axis = 0; axis < 3; ++axis) {
        sum[axis] += d.x * r[axis];
        sum[3 + axis] += d.y * r[axis];
        sum[6 + axis] += d.z * r[axis];
        sum[9 + axis] += weight * (r.x * r[axis]);
      }
      sum[12] += weight * (r.y * r.y);
      sum[13] += weight * (r.y * r.z);
      sum[14] += weight * (r.z * r.z);
    });
    const auto of = team.total(products);
    if (!team.leads()) return;
    const Matrix3 r = w.rotation[s];
    Matrix3 member = r, beside = r;
    turned = r * rest - rest;
    if (body.volume_share > 0 && w.slot_size[s] > 1) {  // of one particle A0 is rounding
      const float per_h = 1.0f / body.h;
      const float a0[3][3] = {
          {of.v[9], of.v[10], of.v[11]}, {of.v[10], of.v[12], of.v[13]}, {of.v[11], of.v[13], of.v[14]}};
      Matrix3 change;
      for (int row = 0; row < 3; ++row) {
        const float mean = moved[row] / total.v[6];
        for (int k = 0; k < 3; ++k) change(row, k) = per_h * (of.v[3 * row + k] - mean * (per_h * rest[k]));
      }
      const VolumeMaps maps = volume_maps(a0, change, r);
      member = map_towards(body.volume_share, maps.pull, r);
      beside = map_towards(body.volume_share, maps.target, r);
      turned = (1.0f / (1.0f - body.volume_share)) * (member * rest);
      for (int k = 0; k < 9; k += 4) {
        member.m[k] += 1.0f;
        beside.m[k] += 1.0f;
      }
    }
    w.member_map[s] = member;
    w.beside_map[s] = beside;
  } else {
    if (!team.leads()) return;
    turned = w.rotation[s] * rest - rest;
  }
  w.center[s] = base + (1.0f / total.v[6]) * (moved - turned);
}

// Displacement of a point that rests at X_p + arm: β d_p, and the mean over p's clusters of (1 - β)(t - T) +
// (C - (1 - β) I)(X_p - T) + (B - I) arm. Where β = 0, both maps are R - I. Without a cluster p's displacement.
template <bool kVolume>
CUTPROOF_DEVICE inline Float3 carried(const DeviceView& w, const BodyConstants& body, int p, Float3 arm) {
  // Relative to where the first cluster puts the point, so that summing costs no digits of d. (A blade may have pushed
  // the owner far from where its clusters put the point.)
  const Float3 own = xyz(w.displacement[p]);
  Float3 base = own, sum;
  const Coordinates at = coordinates(body, w.node[p]);
  struct Holder {
    RestCenter rest;
    Float3 center;
    Matrix3 member, beside;
  };
  // Several at once: one by one, each read would wait for the previous one.
  constexpr int kAtOnce = 4;
  const int clusters = w.membership_count[p], begin = w.membership_begin[p];
  CUTPROOF_ROLLED for (int first = 0; first < clusters; first += kAtOnce) {
    Holder holder[kAtOnce];
    for (int t = 0; t < kAtOnce; ++t) {
      const int s = w.memberships[begin + (first + t < clusters ? first + t : first)];
      holder[t] = {rest_center(w, s), w.center[s], kVolume ? w.member_map[s] : w.rotation[s], {}};
      if constexpr (kVolume) holder[t].beside = w.beside_map[s];
    }
    for (int t = 0; t < kAtOnce; ++t) {
      if (first + t >= clusters) break;
      Float3 r = body.h * nodes_between(holder[t].rest, at), center = holder[t].center;
      const bool keeps_volume = kVolume && body.volume_share > 0;
      if (!keeps_volume) r = r + arm;
      Float3 turned = holder[t].member * r - r;
      if (keeps_volume) {
        turned = turned + (holder[t].beside * arm - arm);
        center = center + body.volume_share * (own - center);
      }
      if (first + t == 0) base = center + turned;
      sum = sum + ((center - base) + turned);
    }
  }
  return clusters > 0 ? base + (1.0f / static_cast<float>(clusters)) * sum : base;
}

}  // namespace cutproof::gpu
