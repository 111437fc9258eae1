// Loss of precision of coordinates in the body's frame, compared with displacements from rest.
#pragma once
#include <algorithm>

#include "model/at.h"
#include "model/body.h"
#include "model/state.h"

namespace cutproof {

// State::place_rounding of a state with such coordinates in its precision: u times the greatest distance from the
// origin, at rest or deformed [m].
inline double rounding_of_coordinates(const Body& body, const State& state) {
  double farthest = 0;
  for (int32_t i = 0; i < body.particle_count(); ++i) farthest = std::max(farthest, norm(body.rest_position(i)));
  for (const Vec3& x : state.x) farthest = std::max(farthest, norm(x));  // NaN is no greater
  return unit_roundoff(state) * farthest;
}

}  // namespace cutproof
