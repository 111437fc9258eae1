#include "benchmarks/step_traffic.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "gpu/state/device_view.h"
#include "model/at.h"

namespace cutproof::benchmarks {

namespace {

// What kernels make of the clusters (gpu/kernels/groups.cuh).
struct Groups {
  double groups = 0, pairs = 0, loose = 0, loose_memberships = 0;
};

Groups groups_of(const Setup& setup, const State& state) {
  // Lists of holders by what two mixes of them come to: 64 bits tell them apart.
  const auto n = at(setup.body.particle_count());
  std::vector<std::pair<uint64_t, int32_t>> holders(n);  // mix, how many
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    for (const int32_t i : state.clusters.of(c)) {
      auto& [mix, count] = holders[at(i)];
      mix = (mix ^ static_cast<uint64_t>(c + 1)) * 0x9e3779b97f4a7c15u;
      mix ^= mix >> 29;
      ++count;
    }
  }
  Groups found;
  const auto let_loose = [&](double particles, double each) {
    found.loose += particles;
    found.loose_memberships += particles * each;
  };
  std::vector<uint8_t> held(n, 0);
  for (const Grip& grip : setup.grips) {
    for (const int32_t i : grip.particles) held[at(i)] = 1;
  }
  std::vector<std::pair<uint64_t, int32_t>> classes;
  for (std::size_t i = 0; i < n; ++i) {
    if (!state.alive[i]) continue;
    if (held[i] != 0 || holders[i].second == 0) {
      let_loose(1, holders[i].second);
    } else {
      classes.push_back(holders[i]);
    }
  }
  std::sort(classes.begin(), classes.end());
  for (std::size_t begin = 0, end = 0; begin < classes.size(); begin = end) {
    while (end < classes.size() && classes[end] == classes[begin]) ++end;
    const auto size = static_cast<int64_t>(end - begin), left = size % gpu::kMostInGroup;
    const bool grouped = left >= gpu::kLeastInGroup;
    const auto groups = static_cast<double>(size / gpu::kMostInGroup + (grouped ? 1 : 0));
    found.groups += groups;
    found.pairs += groups * classes[begin].second;
    if (!grouped) let_loose(static_cast<double>(left), classes[begin].second);
  }
  return found;
}

}  // namespace

StepTraffic step_traffic(const Setup& setup, const State& state) {
  const auto particles = static_cast<double>(setup.body.particle_count());
  const auto clusters = static_cast<double>(state.clusters.count());
  const Groups of = groups_of(setup, state);
  const bool contacts = setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
  const bool accelerated = setup.step.acceleration != Acceleration::none;
  // match_shapes. Pair: offset 16. Group: moments 48, mass 16, base 16. Loose particle: position 16, node 4, and its
  // place in each cluster 4. Cluster: size, body, where its lists are 24, rest sums 48, rotation in and out 72,
  // placement 48, flag 4.
  const double match = 16 * of.pairs + 80 * of.groups + 20 * of.loose + 4 * of.loose_memberships + 192 * clusters;
  // advance. Pair: offset 16. Group: head 32, base 16, map in and out 96, moments of the prediction in and of the
  // position out 96, masses 48; with contacts rest centre, side and resolved 24. Loose particle: places 8, position in
  // and out 32, predicted 16, node, share and first holder 12, a slot for each holder 4; with contacts start 16, pushed
  // in and out 32. Cluster: placement 48; of loose particles rest frame 24. Accelerated, the same of one iteration ago:
  // maps in and out 96, positions 32, with contacts pushed 32.
  const double advance = 16 * of.pairs + (288 + (contacts ? 24 : 0) + (accelerated ? 96 : 0)) * of.groups +
                         (68 + (contacts ? 48 : 0) + (accelerated ? (contacts ? 64 : 32) : 0)) * of.loose +
                         4 * of.loose_memberships + (of.loose > 0 ? 72 : 48) * clusters;
  // start_substep, once more than there are substeps; what it does first and last alone comes below. Particle: start in
  // and out 32, predicted in and out 32, node 4. Group: head 32, rest centre 16, map 48, base in and out 32, moments
  // out 96, mass 16; with contacts side, resolved and touched 12. Loose particle besides: its place 4, position in and
  // out 32; with contacts pushed and impulse, in and out 64.
  const double substep =
      68 * particles + (240 + (contacts ? 12 : 0)) * of.groups + (36 + (contacts ? 64 : 0)) * of.loose;
  // Once a frame: displacement and velocity in and out 64, whose they are 8; begin_frame's impulse and death 20.
  const double frame = 92 * particles;
  const int64_t substeps = setup.step.substeps, iterations = setup.step.iterations;
  return {frame + static_cast<double>(substeps) * (substep + static_cast<double>(iterations) * (match + advance)),
          2 + substeps * (1 + (setup.grips.empty() ? 0 : 1) + 2 * iterations)};
}

}  // namespace cutproof::benchmarks
