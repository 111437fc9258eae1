#include "benchmarks/stage_limits.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "benchmarks/phase_counter.h"
#include "gpu/state/device_view.h"
#include "model/at.h"

namespace cutproof::benchmarks {

namespace {

uint64_t mixed(uint64_t mix, uint64_t with) {
  mix = (mix ^ (with + 1)) * 0x9e3779b97f4a7c15u;
  return mix ^ mix >> 29;
}

}  // namespace

Groups groups_of(const Setup& setup, const State& state) {
  // Lists of holders by two mixes of them: 64 bits distinguish them.
  const auto n = at(setup.body.particle_count());
  std::vector<std::pair<uint64_t, int32_t>> holders(n);  // mix, how many
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    for (const int32_t i : state.clusters.of(c)) {
      auto& [mix, count] = holders[at(i)];
      mix = mixed(mix, static_cast<uint64_t>(c));
      ++count;
    }
  }
  Groups found;
  const auto let_loose = [&](double particles, double each) {
    found.loose += particles;
    found.loose_memberships += particles * each;
  };
  std::vector<uint64_t> held(n, 0);  // by which grips: a mix of them
  for (std::size_t grip = 0; grip < setup.grips.size(); ++grip) {
    for (const int32_t i : setup.grips[grip].particles) held[at(i)] = mixed(held[at(i)], grip);
  }
  std::vector<std::pair<uint64_t, int32_t>> classes;
  for (std::size_t i = 0; i < n; ++i) {
    if (!state.alive[i]) continue;
    if (holders[i].second == 0) {
      let_loose(1, 0);
    } else {
      classes.emplace_back(mixed(holders[i].first, held[i]), holders[i].second);
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

namespace {

double step_bytes(const Setup& setup, const State& state) {
  const auto particles = static_cast<double>(setup.body.particle_count());
  const auto clusters = static_cast<double>(state.clusters.count());
  const Groups of = groups_of(setup, state);
  const bool contacts = setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
  const bool accelerated = setup.step.acceleration != Acceleration::none;
  // match_shapes. Pair: offset 16. Group: moments 48, mass 16, base 16. Loose particle: position 16, node 4, and its
  // place in each cluster 4. Cluster: size, body, places of its lists 24, rest sums 48, rotation in and out 72,
  // placement 48, flag 4.
  const double match = 16 * of.pairs + 80 * of.groups + 20 * of.loose + 4 * of.loose_memberships + 192 * clusters;
  // advance. Pair: offset 16. Group: head 32, base 16, map in and out 96, moments of the prediction in and of the
  // position out 96, masses 48; with contacts room and resolved 8. Loose particle: places 8, position in
  // and out 32, predicted 16, node, share and first holder 12, a slot for each holder 4; with contacts start 16, pushed
  // in and out 32. Cluster: placement 48; of loose particles rest frame 24. Accelerated, the same of one iteration ago:
  // maps in and out 96, positions 32, with contacts pushed 32.
  const double advance = 16 * of.pairs + (288 + (contacts ? 8 : 0) + (accelerated ? 96 : 0)) * of.groups +
                         (68 + (contacts ? 48 : 0) + (accelerated ? (contacts ? 64 : 32) : 0)) * of.loose +
                         4 * of.loose_memberships + (of.loose > 0 ? 72 : 48) * clusters;
  // begin_substep. Group: head 32, masses 48, map 48, base in and out 32, place and velocity in and out 192, initial
  // values of the frame 96, moments out 96; with contacts rest centre 16, its first displacement and velocity 32, room,
  // side, resolved and tracked 16. Loose particle: places and count of holders 12, place and motion 32,
  // start, predicted and position out 48; with contacts node, pushed and impulse, in and out 68.
  const double substep = (544 + (contacts ? 64 : 0)) * of.groups + (92 + (contacts ? 68 : 0)) * of.loose;
  // begin_first_substep, particle of a group: places 8, displacement and velocity 32; group: head and rest centre 48,
  // mass 16, its first displacement and velocity, place and velocity 128, moments of both 96, base and moments out 112;
  // with contacts room, side, resolved and tracked 16. Loose particle: as above; with contacts node, and pushed
  // out 20.
  const double first =
      40 * (particles - of.loose) + (400 + (contacts ? 16 : 0)) * of.groups + (92 + (contacts ? 20 : 0)) * of.loose;
  // Once a frame. begin_frame, particle: impulse and death 20. end_step, particle: places 8, displacement and velocity
  // in and out 64; group: head and rest centre 48, its first displacement and velocity 32, base and map 64, place and
  // velocity 96; with contacts tracked 4. Loose particle: places 8, start and position 32, displacement and velocity
  // out 32; with contacts pushed and impulse in and out 48.
  const double frame = 20 * particles + 72 * (particles - of.loose) + (240 + (contacts ? 4 : 0)) * of.groups +
                       (72 + (contacts ? 48 : 0)) * of.loose;
  const int iterations = setup.step.substeps * setup.step.iterations;
  return frame + first + (setup.step.substeps - 1) * substep + iterations * (match + advance);
}

// Detection by distance. Particle: death and node 8, displacement 16, flag out and in 2. Node: its particle 4. By
// strain, a member of a cluster, in each of two passes: particle 4, node, count of memberships 8, displacement 16; a
// particle: death 4, flag out and in 2, memberships and their places 8.
double detect_bytes(const Setup& setup, const State& state) {
  const auto particles = static_cast<double>(setup.body.particle_count());
  const auto members = static_cast<double>(state.clusters.members.size());
  switch (setup.detect.criterion) {
    case Criterion::distance:
      return 26 * particles + 4 * static_cast<double>(setup.body.particle_at.size());
    case Criterion::strain:
      return 56 * members + 14 * particles + 4 * members;
    default:
      return 7 * particles;  // geometric: death, flag out, flag in and in again
  }
}

// Skin positions. A vertex lies where a particle has no neighbour in a direction: its owner, direction 5, position out
// 16; owner: displacement 16, node, body, memberships and their places 16. Cluster that carries a vertex: rotation,
// rest centre and base, centre out and in 84; its members as detection by strain, once.
double skin_bytes(const Setup& setup, const State& state) {
  if (!setup.skin.wanted) return 0;
  double bytes = 0;
  std::vector<uint8_t> owns(state.alive.size(), 0);
  for (int32_t p = 0; p < setup.body.particle_count(); ++p) {
    if (!state.alive[at(p)]) continue;
    for (std::size_t direction = 0; direction < kDirections.size(); ++direction) {
      const int32_t other = setup.body.neighbour(p, static_cast<int>(direction));
      if (other >= 0 && state.alive[at(other)]) continue;
      bytes += 21;
      owns[at(p)] = 1;
    }
  }
  bytes += 32 * static_cast<double>(std::count(owns.begin(), owns.end(), 1));
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    const auto members = state.clusters.of(c);
    if (std::any_of(members.begin(), members.end(), [&](int32_t i) { return owns[at(i)] != 0; })) {
      bytes += 84 + 28 * static_cast<double>(members.size());
    }
  }
  return bytes;
}

}  // namespace

StageLimits stage_limits(const Setup& setup, const State& state) {
  const auto phases = phases_of_stages(gpu::make_plan({setup}, {state}));
  StageLimits limits;
  for (std::size_t k = 0; k < kStages.size(); ++k) limits[k].phases = phases[k];
  const auto bytes_of = [&](Stage stage) -> double& { return limits[static_cast<std::size_t>(stage)].bytes; };
  bytes_of(Stage::step) = step_bytes(setup, state);
  bytes_of(Stage::detect) = detect_bytes(setup, state);
  bytes_of(Stage::skin) = skin_bytes(setup, state);
  return limits;
}

nlohmann::json limit_json(const StageLimit& limit, const MachineLimits& machine, double median) {
  const double bytes_seconds = limit.bytes / machine.copy_bytes_per_second;
  const double phase_seconds = static_cast<double>(limit.phases) * machine.phase_seconds();
  const double seconds = std::max(bytes_seconds, phase_seconds);
  nlohmann::json result = {{"bytes", limit.bytes},
                           {"phases", limit.phases},
                           {"bytes_seconds", bytes_seconds},
                           {"phases_seconds", phase_seconds},
                           {"seconds", seconds},
                           {"multiple", nullptr}};
  if (seconds > 0) result["multiple"] = median / seconds;
  return result;
}

}  // namespace cutproof::benchmarks
