// Sums over the particles of a body, in extended precision, so that only the rounding of the judged values is left.
// Internal to oracles/.
#pragma once
#include <array>
#include <vector>

#include "model/body.h"
#include "model/state.h"
#include "oracles/support.h"

namespace cutproof::oracles {

struct Totals {
  long double mass = 0;                                   // Σ m [kg]
  std::array<long double, 3> momentum = {}, moment = {};  // Σ m v, Σ m x
  long double speed = 0;                                  // Σ m |v|

  void add(long double m, Vec3 x, Vec3 v) {
    mass += m;
    for (int axis = 0; axis < 3; ++axis) {
      momentum[at(axis)] += m * v[axis];
      moment[at(axis)] += m * x[axis];
    }
    speed += m * norm(v);
  }
  Vec3 total_momentum() const { return vector(momentum, 1); }
  Vec3 center() const { return vector(moment, mass); }
  static Vec3 vector(const std::array<long double, 3>& v, long double divisor) {
    return {static_cast<double>(v[0] / divisor), static_cast<double>(v[1] / divisor),
            static_cast<double>(v[2] / divisor)};
  }
};

// Of the particles in `mask` [n].
inline Totals totals_of(const Body& body, const State& state, const std::vector<uint8_t>& mask) {
  Totals totals;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] != 0) totals.add(body.mass[i], state.x[i], state.v[i]);
  }
  return totals;
}

}  // namespace cutproof::oracles
