// The difference of a rotation that a cluster should have kept, in words. Internal to oracles/.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "oracles/support.h"

namespace cutproof::oracles {

// Requires that rotation or flag of the two differ in bits. Of two rotations |R − R'| = 2 √2 sin(angle / 2), which is
// exact also where the angle is far below one degree.
inline std::string rotation_change(const Clusters& before, int32_t was, const Clusters& after, int32_t is) {
  const Mat3 &from = before.rotation[at(was)], &to = after.rotation[at(is)];
  double squares = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double off = to(row, column) - from(row, column);
      squares += off * off;
    }
  }
  if (squares > 8.001) return "it differs by more than a turn can make it";
  if (squares > 0) {
    const double half = std::asin(std::min(1.0, std::sqrt(squares / 8)));
    return sentence("it is turned by {:.3g} degrees", 2 * half * 180 / std::numbers::pi);
  }
  if (before.degenerate[at(was)] != after.degenerate[at(is)]) {
    return after.degenerate[at(is)] != 0 ? "it is the same, but is marked as not unique"
                                         : "it is the same, but is no longer marked as not unique";
  }
  return squares == 0 ? "it is the same but for the sign of a zero" : "it has entries that are no numbers";
}

}  // namespace cutproof::oracles
