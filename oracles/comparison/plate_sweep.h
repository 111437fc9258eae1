// The plate's outline, and how finely its turning is followed. Internal to oracles/comparison/.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "model/setup.h"
#include "oracles/blade_motion.h"

namespace cutproof::oracles {

// Turning is followed in pieces in which no point of the plate is off its way by more than this [h].
inline constexpr double kTurningSlack = 0.01;

// Corners of the mid-surface; side k goes from corner k to corner k + 1: the cutting edge, the side at +along, the
// back, the side at -along.
inline std::array<Vec3, 4> plate_of(const Blade& blade, const BladePose& pose) {
  const Vec3 half = (blade.length / 2) * pose.along, deep = blade.depth * pose.back;
  return {pose.edge - half, pose.edge + half, pose.edge + half + deep, pose.edge - half + deep};
}

// In how many pieces a move is followed.
inline int turning_pieces(const Setup& setup, const BladeMove& move) {
  // An arc of angle φ and radius r is off its chord by r φ² / 8.
  const double angle = turn_between(move.from, move.to).angle;
  const double radius = std::hypot(setup.blade.length / 2, setup.blade.depth);
  const double slack = kTurningSlack * setup.body.grid.spacing;
  return std::max(1, static_cast<int>(std::ceil(angle * std::sqrt(radius / (8 * slack)))));
}

}  // namespace cutproof::oracles
