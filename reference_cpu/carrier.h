// Where clusters carry what rests on their particles and beside them: by which detection and skin tell how far tissue is
// from the blade that holds it apart. Internal to reference_cpu/.
#pragma once
#include <cstdint>
#include <vector>

#include "model/at.h"
#include "model/memberships.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::reference {

// t_c: where the weighted centre of each cluster is now, with the weights w_ic = m_i / n_i.
inline std::vector<Vec3> current_centers(const Body& body, const State& state, const Memberships& memberships) {
  std::vector<Vec3> centers(static_cast<std::size_t>(state.clusters.count()));
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    double mass = 0;
    Vec3 moment;
    for (const int32_t i : state.clusters.of(c)) {
      const double weight = body.mass[static_cast<std::size_t>(i)] / static_cast<double>(memberships.count(i));
      mass += weight;
      moment += weight * state.x[static_cast<std::size_t>(i)];
    }
    centers[static_cast<std::size_t>(c)] = moment / mass;
  }
  return centers;
}

// Where the clusters of a particle carry what rests on one of its grid edges.
class Carrier {
 public:
  Carrier(const Setup& setup, const State& state)
      : body_(setup.body),
        state_(state),
        memberships_(memberships_of(state.clusters, setup.body.particle_count())),
        centers_(current_centers(setup.body, state, memberships_)) {}

  Vec3 operator()(int32_t owner, int direction, double reach) const {
    const double far = reach * body_.grid.spacing;
    const auto& e = kDirections[at(direction)];
    const Vec3 offset = {far * e[0], far * e[1], far * e[2]};
    const Vec3 rest = body_.rest_position(owner) + offset;
    Vec3 sum;
    for (const int32_t cluster : memberships_.of(owner)) {
      const auto c = static_cast<std::size_t>(cluster);
      sum += centers_[c] + state_.clusters.rotation[c] * (rest - state_.clusters.rest_center[c]);
    }
    // An owner without a cluster breaks I2. Its vertex then goes with the particle, unrotated.
    const auto count = memberships_.count(owner);
    return count > 0 ? sum / static_cast<double>(count) : state_.x[static_cast<std::size_t>(owner)] + offset;
  }

 private:
  const Body& body_;
  const State& state_;
  Memberships memberships_;
  std::vector<Vec3> centers_;
};

}  // namespace cutproof::reference
