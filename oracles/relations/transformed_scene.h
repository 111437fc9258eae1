// A transformed scene: turned by quarter turns, shifted on the grid, scaled, its clusters in another order. A backend's
// answer must be its answer to the original scene, transformed. Internal to oracles/relations/.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "model/fields.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// x' = scale · (P x + offset): old axis a becomes axis target[a], reversed if sign[a] < 0. The offset puts the lowest
// node of the turned grid at `padding`, in new axes. Right-handed.
struct Transform {
  std::array<int, 3> target = {0, 1, 2};
  std::array<int, 3> sign = {1, 1, 1};
  std::array<int32_t, 3> padding = {0, 0, 0};  // layers of empty nodes put in front, new axes
  double scale = 1;
  Vec3 world_shift;  // added to Body::origin: nothing else may change
};

class TransformedScene {
 public:
  TransformedScene(const Transform& transform, const Setup& setup);

  const Setup& setup() const { return transformed_; }
  // Clusters keep their order.
  State state(const State& state) const;
  int32_t particle(int32_t i) const { return particle_[static_cast<std::size_t>(i)]; }

 private:
  template <class T>
  T value(Quantity quantity, const T& given) const;
  Vec3 vector(Vec3 v) const;  // free vectors: velocities, displacements
  Vec3 unit(Vec3 v) const;    // directions: not scaled
  Vec3 point(Vec3 p) const;   // positions
  Mat3 rotation(const Mat3& r) const;
  BladePose pose(const BladePose& pose) const;
  uint8_t direction(uint8_t d) const;
  std::vector<int32_t> particles(const std::vector<int32_t>& list) const;  // ascending
  Body transform_body(const Body& body);

  Transform transform_;
  Vec3 offset_;                    // before scaling
  std::vector<int32_t> particle_;  // [n] old -> new
  Setup transformed_;
};

// The same clusters in another order: numbers stay with the places, `order[j]` says which cluster comes to place j.
State reordered(const State& state, const std::vector<int32_t>& order);

}  // namespace cutproof::oracles
