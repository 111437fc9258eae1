// Partitions of the alive particles, for oracles, reports and expectations. A state that is not well formed has empty
// partitions.
#pragma once
#include <cstdint>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

struct Partition {
  std::vector<int32_t> label;  // [n] component of each alive particle, numbered by smallest particle; -1 if dead
  int32_t count = 0;
};
Partition graph_components(const Setup& setup, const State& state);  // BFS on G
// The same, whatever else is wrong with a state. `alive`: [n].
Partition graph_components(const Body& body, const std::vector<uint8_t>& alive);
Partition coupling_components(const Setup& setup, const State& state);  // "shares a cluster"

// Couplings between clusters that are only a shared particle (ball joint) or collinear ones (hinge) (method.md §7).
struct WeakCouplings {
  int64_t ball_joints = 0, hinges = 0;
};
WeakCouplings weak_couplings(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
