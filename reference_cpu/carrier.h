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

// The maps of each cluster: by R_c of the state, and by V_c and F_c of its positions.
inline std::vector<ClusterMaps> current_maps(const Setup& setup, const State& state, const Memberships& memberships,
                                             const std::vector<Vec3>& centers) {
  std::vector<ClusterMaps> maps;
  for (const Mat3& r : state.clusters.rotation) maps.push_back({r, r});
  if (setup.step.volume_share == 0) return maps;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    if (state.clusters.size(c) == 1) continue;  // A0 would be the rounding of T
    Mat3 a, a0;
    a.m.fill(0);
    a0.m.fill(0);
    for (const int32_t i : state.clusters.of(c)) {
      const double weight = setup.body.mass[at(i)] / static_cast<double>(memberships.count(i));
      const Vec3 now = state.x[at(i)] - centers[at(c)];
      const Vec3 rest = setup.body.rest_position(i) - state.clusters.rest_center[at(c)];
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          a(row, column) += weight * now[row] * rest[column];
          a0(row, column) += weight * rest[row] * rest[column];
        }
      }
    }
    maps[at(c)] = cluster_maps(setup.step.volume_share, a, a0, state.clusters.rotation[at(c)]);
  }
  return maps;
}

// Carries points of a particle's grid edges, or the particle itself (reach 0), as its clusters do.
class Carrier {
 public:
  Carrier(const Setup& setup, const State& state)
      : body_(setup.body),
        state_(state),
        volume_share_(setup.step.volume_share),
        memberships_(memberships_of(state.clusters, setup.body.particle_count())),
        centers_(current_centers(setup.body, state, memberships_)),
        maps_(current_maps(setup, state, memberships_, centers_)) {}

  Vec3 operator()(int32_t owner, int direction = 0, double reach = 0) const {
    const double far = reach * body_.grid.spacing;
    const auto& e = kDirections[at(direction)];
    const Vec3 offset = {far * e[0], far * e[1], far * e[2]};
    const Vec3 rest = body_.rest_position(owner);
    Vec3 sum;
    for (const int32_t cluster : memberships_.of(owner)) {
      const std::size_t c = at(cluster);
      sum += (1 - volume_share_) * centers_[c] + maps_[c].goal * (rest - state_.clusters.rest_center[c]) +
             maps_[c].carry * offset;
    }
    // An owner without a cluster breaks I2. Its points then move with it, unrotated.
    const auto count = memberships_.count(owner);
    if (count == 0) return state_.x[at(owner)] + offset;
    return volume_share_ * state_.x[at(owner)] + sum / static_cast<double>(count);
  }

 private:
  const Body& body_;
  const State& state_;
  double volume_share_;
  Memberships memberships_;
  std::vector<Vec3> centers_;
  std::vector<ClusterMaps> maps_;
};

}  // namespace cutproof::reference
