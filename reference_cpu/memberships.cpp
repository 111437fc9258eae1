#include "reference_cpu/reference.h"

namespace cutproof::reference {

Memberships memberships_of(const Clusters& clusters, int32_t particle_count) {
  Memberships result;
  result.offsets.assign(static_cast<std::size_t>(particle_count) + 1, 0);
  for (const int32_t particle : clusters.members) ++result.offsets[static_cast<std::size_t>(particle) + 1];
  for (std::size_t i = 1; i < result.offsets.size(); ++i) result.offsets[i] += result.offsets[i - 1];

  result.clusters.resize(clusters.members.size());
  std::vector<int64_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    for (const int32_t particle : clusters.of(c)) {
      result.clusters[static_cast<std::size_t>(next[static_cast<std::size_t>(particle)]++)] = c;
    }
  }
  return result;
}

void update_rest_frames(const Body& body, Clusters& clusters) {
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  const auto count = static_cast<std::size_t>(clusters.count());
  clusters.mass.assign(count, 0.0);
  clusters.rest_center.assign(count, Vec3{});
  for (int32_t c = 0; c < clusters.count(); ++c) {
    // Relative to one member: an error of T_c pushes the cluster the same way in every iteration, so it is kept to the
    // rounding of the result.
    const Vec3 base = body.rest_position(clusters.of(c).front());
    double mass = 0;
    Vec3 moment;
    for (const int32_t i : clusters.of(c)) {
      const double weight = body.mass[static_cast<std::size_t>(i)] / static_cast<double>(memberships.count(i));
      mass += weight;
      moment += weight * (body.rest_position(i) - base);
    }
    clusters.mass[static_cast<std::size_t>(c)] = mass;
    clusters.rest_center[static_cast<std::size_t>(c)] = base + moment / mass;
  }
}

}  // namespace cutproof::reference
