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
  std::vector<double> weight(static_cast<std::size_t>(body.particle_count()));  // w_ic, the same for every cluster of i
  std::vector<Vec3> rest(weight.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const auto particle = static_cast<int32_t>(i);
    weight[i] = body.mass[i] / static_cast<double>(memberships.count(particle));
    rest[i] = body.rest_position(particle);
  }
  clusters.mass.assign(count, 0.0);
  clusters.rest_center.assign(count, Vec3{});
  for (int32_t c = 0; c < clusters.count(); ++c) {
    // Relative to one member, which keeps T_c accurate to the rounding of the result. An error of T_c pushes the
    // cluster the same way in every iteration.
    const Vec3 base = rest[static_cast<std::size_t>(clusters.of(c).front())];
    double mass = 0;
    Vec3 moment;
    for (const int32_t particle : clusters.of(c)) {
      const auto i = static_cast<std::size_t>(particle);
      mass += weight[i];
      moment += weight[i] * (rest[i] - base);
    }
    clusters.mass[static_cast<std::size_t>(c)] = mass;
    clusters.rest_center[static_cast<std::size_t>(c)] = base + moment / mass;
  }
}

}  // namespace cutproof::reference
