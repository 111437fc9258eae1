#include "oracles/comparison/trajectory.h"

#include "oracles/comparison/state_difference.h"
#include "oracles/oracles.h"

namespace cutproof::oracles {

Pose pose_of(const Setup& setup, const State& state, const Pose* earlier) {
  Pose pose{state.x, state.alive, 0};
  pose.components = earlier != nullptr && !pose.removed_some_since(*earlier) ? earlier->components
                                                                             : graph_components(setup, state).count;
  return pose;
}

Apart poses_apart(const Setup& setup, const Pose& expected, const Pose& actual) {
  Apart apart;
  std::vector<uint8_t> both(expected.alive.size());
  for (std::size_t i = 0; i < both.size(); ++i) {
    both[i] = expected.alive[i] && actual.alive[i];
    apart.alive_in_one += expected.alive[i] != actual.alive[i];
  }
  apart.position = position_error(setup, expected.x, actual.x, both);
  return apart;
}

}  // namespace cutproof::oracles
