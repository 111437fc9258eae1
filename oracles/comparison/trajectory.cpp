#include "oracles/comparison/trajectory.h"

#include <algorithm>

#include "oracles/comparison/state_difference.h"
#include "oracles/oracles.h"

namespace cutproof::oracles {

Pose pose_of(const Setup& setup, const State& state, const Pose* earlier) {
  Pose pose{state.x, state.alive, 0};
  pose.components = earlier != nullptr && !pose.removed_some_since(*earlier) ? earlier->components
                                                                             : graph_components(setup, state).count;
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    uint64_t hash = 14695981039346656037u;  // FNV-1a, a member at a time
    for (const int32_t i : state.clusters.of(c)) hash = (hash ^ static_cast<uint64_t>(i)) * 1099511628211u;
    pose.clusters.push_back(hash);
  }
  std::sort(pose.clusters.begin(), pose.clusters.end());
  return pose;
}

void add_pose(std::vector<Pose>& poses, const Setup& setup, const State& state) {
  poses.push_back(pose_of(setup, state, poses.empty() ? nullptr : &poses.back()));
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
