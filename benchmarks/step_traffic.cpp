#include "benchmarks/step_traffic.h"

namespace cutproof::benchmarks {

StepTraffic step_traffic(const Setup& setup, const State& state) {
  const auto particles = static_cast<double>(setup.body.particle_count());
  const auto memberships = static_cast<double>(state.clusters.members.size());
  const auto clusters = static_cast<double>(state.clusters.count());
  const bool contacts = setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
  // match_shapes. Member: its index. Particle: displacement 16, node 4, share 4. Cluster: begin, size, body 12, rest
  // frame 24, rotation in and out 72, centre 12, flag 4.
  const double match = 4 * memberships + 24 * particles + 124 * clusters;
  // update_positions. Member: its slot. Particle: displacement in and out 32, predicted 16, node, share, first holder,
  // death 16; with contacts start 16, pushed in and out 32. Cluster: rest frame 24, rotation 36, centre 12.
  // Accelerated, the same of one iteration ago: displacement in and out 32, with contacts pushed in and out 32.
  const bool accelerated = setup.step.acceleration != Acceleration::none;
  const double earlier = accelerated ? (contacts ? 64 : 32) : 0;
  const double update = 4 * memberships + (64 + (contacts ? 48 : 0) + earlier) * particles + 72 * clusters;
  // Once a substep. Out: start 16, predicted 16; in: start 16 without contacts; with contacts impulse in and out 32.
  const double substep = (32 + (contacts ? 32 : 16)) * particles;
  // Once a frame, begin_frame and the last velocity. Displacement in and out 32, velocity in and out 32, node and death
  // 8, impulse out 16.
  const double frame = 88 * particles;
  const int64_t substeps = setup.step.substeps, iterations = setup.step.iterations;
  return {frame + static_cast<double>(substeps) * (substep + static_cast<double>(iterations) * (match + update)),
          1 + substeps * ((contacts ? 1 : 0) + 2 * iterations)};
}

}  // namespace cutproof::benchmarks
