// Positions of a body at the end of every frame of a scene, and distances of two runs of one scene. Runs may divide
// frames differently and have different clusters, so nothing but particles is compared (measure_and_tune.md, Tuning).
#pragma once
#include <cstdint>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

struct Pose {
  std::vector<Vec3> x;                  // [n] body frame [m]
  std::vector<uint8_t> alive;           // [n]
  int32_t components = 0;               // of the tissue
  std::vector<uint64_t> clusters = {};  // ascending: of each a hash of its members

  bool removed_some_since(const Pose& earlier) const { return alive != earlier.alive; }
};

// Of a well-formed state. `earlier` is a pose of the same body, whose components are taken over where nothing was
// removed since; null: they are counted.
Pose pose_of(const Setup& setup, const State& state, const Pose* earlier);
// Appends the pose of a state that follows those before.
void add_pose(std::vector<Pose>& poses, const Setup& setup, const State& state);

// Particles that only one of the two has are only counted: in a dynamic cut, layers next to the cut may or may not be
// removed.
struct Apart {
  ErrorNorm position;        // of particles alive in both [h]; infinite if one is not a number
  int64_t alive_in_one = 0;  // particles that only one of the two still has
};
Apart poses_apart(const Setup& setup, const Pose& expected, const Pose& actual);

}  // namespace cutproof::oracles
