// The pose of the blade within one of its moves (model/blade.h), and a point's coordinates relative to it. Internal to
// oracles/.
#pragma once
#include <algorithm>
#include <cmath>

#include "model/blade.h"

namespace cutproof::oracles {

// Of a vector in the blade's own axes: u along the cutting edge, w from the edge to the back, n along the normal. The
// mid-surface is |u| <= length / 2, 0 <= w <= depth, n = 0 from the middle of the edge.
struct Local {
  double u = 0, n = 0, w = 0;
};

inline Local to_local(const BladePose& pose, Vec3 v) {
  return {dot(v, pose.along), dot(v, cross(pose.along, pose.back)), dot(v, pose.back)};
}

// The turn from one orientation to another about one axis.
struct Turn {
  Vec3 axis = {0, 0, 1};  // unit
  double angle = 0;       // [0, π]
};

// From R = Σ b_k a_kᵀ: its trace is 1 + 2 cos, its skew part 2 sin times the axis. At half a turn the skew part has no
// direction any more, and R + 1 = 2 axis axisᵀ: its longest column is along the axis.
inline Turn turn_between(const BladePose& a, const BladePose& b) {
  const Vec3 from[3] = {a.along, a.back, cross(a.along, a.back)};
  const Vec3 to[3] = {b.along, b.back, cross(b.along, b.back)};
  Vec3 twice_sine;
  double trace = 0;
  for (int k = 0; k < 3; ++k) {
    twice_sine += cross(from[k], to[k]);
    trace += dot(from[k], to[k]);
  }
  const double size = norm(twice_sine);
  constexpr double kNoDirection = 1e-8;  // far above the rounding of `twice_sine`, whose terms are at most 1
  if (trace < 0 && size <= kNoDirection) {
    Vec3 longest;
    for (int column = 0; column < 3; ++column) {
      Vec3 v;
      for (int k = 0; k < 3; ++k) v += from[k][column] * to[k];
      v[column] += 1;
      if (norm(v) > norm(longest)) longest = v;
    }
    return {normalized(longest), std::atan2(size / 2, (trace - 1) / 2)};
  }
  if (!(size > 0)) return {};
  return {twice_sine / size, std::atan2(size / 2, (trace - 1) / 2)};
}

// `fraction` of the turn applied to a vector, by Rodrigues' formula.
inline Vec3 rotated(Vec3 v, const Turn& turn, double fraction) {
  const double angle = fraction * turn.angle;
  return std::cos(angle) * v + std::sin(angle) * cross(turn.axis, v) +
         (1 - std::cos(angle)) * dot(turn.axis, v) * turn.axis;
}

// `fraction` of the way from one pose to the other.
inline BladePose pose_between(const BladePose& a, const BladePose& b, double fraction) {
  if (fraction <= 0) return a;
  if (fraction >= 1) return b;
  const Vec3 edge = a.edge + fraction * (b.edge - a.edge);
  if (a.along == b.along && a.back == b.back) return {edge, a.along, a.back};
  const Turn turn = turn_between(a, b);
  return {edge, rotated(a.along, turn, fraction), rotated(a.back, turn, fraction)};
}

}  // namespace cutproof::oracles
