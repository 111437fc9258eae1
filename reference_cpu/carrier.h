// Where clusters carry points at and beside their particles. Detection and skin use it to measure how far tissue is
// from the blade that separates it. Internal to reference_cpu/.
#pragma once
#include <cstdint>
#include <vector>

#include "model/at.h"
#include "model/setup.h"
#include "model/state.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {

// t_c: the present weighted centre of each cluster, with the weights w_ic = m_i / n_i.
inline std::vector<Vec3> current_centers(const Body& body, const State& state, const Memberships& memberships) {
  std::vector<Vec3> centers(at(state.clusters.count()));
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    double mass = 0;
    Vec3 moment;
    for (const int32_t i : state.clusters.of(c)) {
      const double weight = body.mass[at(i)] / static_cast<double>(memberships.count(i));
      mass += weight;
      moment += weight * state.x[at(i)];
    }
    centers[at(c)] = moment / mass;
  }
  return centers;
}

// Carries points of a particle's grid edges, or the particle itself (reach 0), as its clusters do.
class Carrier {
 public:
  Carrier(const Setup& setup, const State& state)
      : body_(setup.body),
        state_(state),
        memberships_(memberships_of(state.clusters, setup.body.particle_count())),
        centers_(current_centers(setup.body, state, memberships_)) {}

  Vec3 operator()(int32_t owner, int direction = 0, double reach = 0) const {
    const double far = reach * body_.grid.spacing;
    const auto& e = kDirections[at(direction)];
    const Vec3 offset = {far * e[0], far * e[1], far * e[2]};
    const Vec3 rest = body_.rest_position(owner) + offset;
    Vec3 sum;
    for (const int32_t cluster : memberships_.of(owner)) {
      const std::size_t c = at(cluster);
      sum += centers_[c] + state_.clusters.rotation[c] * (rest - state_.clusters.rest_center[c]);
    }
    // An owner without a cluster breaks I2. Its points then move with it, unrotated.
    const auto count = memberships_.count(owner);
    return count > 0 ? sum / static_cast<double>(count) : state_.x[at(owner)] + offset;
  }

 private:
  const Body& body_;
  const State& state_;
  Memberships memberships_;
  std::vector<Vec3> centers_;
};

}  // namespace cutproof::reference
