// Where the blade is within one of its moves (model/blade.h). Internal to oracles/.
#pragma once
#include <algorithm>
#include <cmath>

#include "model/blade.h"

namespace cutproof::oracles {

// The turn from one orientation to another about one axis, from R = Σ b_k a_kᵀ: its trace is 1 + 2 cos, its skew part
// 2 sin times the axis.
struct Turn {
  Vec3 axis;
  double angle = 0;  // [0, π)
};
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
  if (!(size > 0)) return {};
  return {twice_sine / size, std::atan2(size / 2, (trace - 1) / 2)};
}

// `fraction` of the way from one pose to the other.
inline BladePose pose_between(const BladePose& a, const BladePose& b, double fraction) {
  if (fraction <= 0) return a;
  if (fraction >= 1) return b;
  const Turn turn = turn_between(a, b);
  const double angle = fraction * turn.angle;
  const auto turned = [&](Vec3 v) {  // Rodrigues
    return std::cos(angle) * v + std::sin(angle) * cross(turn.axis, v) +
           (1 - std::cos(angle)) * dot(turn.axis, v) * turn.axis;
  };
  const bool same = a.along == b.along && a.back == b.back;
  return {a.edge + fraction * (b.edge - a.edge), same ? a.along : turned(a.along), same ? a.back : turned(a.back)};
}

}  // namespace cutproof::oracles
