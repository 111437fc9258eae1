// Rest positions of particles in units of h, and whether they lie on one line. Internal to oracles/.
#pragma once
#include <cstdint>
#include <span>

#include "model/at.h"
#include "model/body.h"

namespace cutproof::oracles {

// [h]; exact on a grid.
inline Vec3 rest_in_spacings(const Body& body, int32_t particle) {
  if (!body.on_grid()) return body.rest_position(particle) / body.grid.spacing;
  const auto c = body.grid.coordinates(body.node[at(particle)]);
  return {1.0 * c[0], 1.0 * c[1], 1.0 * c[2]};
}

// On a grid exactly, because nodes have integer coordinates; of a bare graph up to so much of the distances from the
// first, which is far more than rest positions round and far less than what gives a cluster a second direction.
inline constexpr double kOnALine = 1e-9;

inline bool is_on_a_line(const Body& body, std::span<const int32_t> particles) {
  const Vec3 first = rest_in_spacings(body, particles.front());
  Vec3 way;
  for (const int32_t i : particles) {
    const Vec3 d = rest_in_spacings(body, i) - first;
    if (way == Vec3{}) way = d;
    const double across = norm(cross(way, d));
    if (body.on_grid() ? across != 0 : across > kOnALine * norm(way) * norm(d)) return false;
  }
  return true;
}

}  // namespace cutproof::oracles
