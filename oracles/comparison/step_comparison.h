// A step of a backend beside the reference's from the same state (guide.md, Errors, implementation): how far
// they are apart, and what rounding decides, so that both answers are right (docs/design/tolerances.md, Against the
// reference).
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

// How far apart the rotations of a cluster are, where the best rotation of the cluster at expected.x is unique:
// (σ2 + σ3) / σ1 >= kUniqueRotation, with σ3 negative for a reflection.
inline constexpr double kUniqueRotation = 1e-4;
struct RotationDifference {
  double angle = 0;  // [rad]
  // What moved positions of members would explain the angle: |angle| (σ2 + σ3) / (√2 Σ w |X - T|) [h]. Positions off by
  // δ change A by at most Σ w |X - T| δ, and this turns R by at most √2 / (σ2 + σ3) of that (docs/design/tolerances.md,
  // One substep).
  double displacement = 0;
  bool unique = true;          // false: they differ, and both may be right
  bool moves_members = false;  // if not unique; the free axis of a cluster that is collinear at rest moves none
};
// [m]. Both states have the same clusters.
std::vector<RotationDifference> rotation_differences(const Setup& setup, const State& expected, const State& actual);

// Greatest extent of the body at rest, over the three axes [h].
double body_extent(const Body& body);

// What the project asks of the positions after a step [h]; of velocities [h/dt] twice that, because each is the
// difference of two positions.
double position_bound(const Body& body);

// What rounding decides within a step, so that both answers are right: counted, and not measured.
struct Undecidable {
  int64_t removals = 0;               // particles removed by one only, within the rounding band of detection
  int64_t sides = 0;                  // particles in the blade's plane at the start of a substep
  int64_t sides_taken_otherwise = 0;  // of these: the reference was led to the backend's side
  int64_t rotations = 0;              // clusters: not unique, of a particle that is undecidable, or as sensitive
  int64_t sensitive = 0;              // particles beyond the bound that one rounding of the start carries as far
  int64_t particles_excluded = 0;     // from position and velocity, for any of these reasons or by a rotation's

  void join(const Undecidable& other);
};

struct StepDifference {
  State expected;                // what the reference makes of the step
  ErrorNorm position, velocity;  // [h], [h/dt]
  ErrorNorm angle, rotation;     // [rad], and as displacements [h]; empty if the clusters are not the same
  Undecidable undecidable;
};

// Compares steps of one body, frame after frame.
class StepComparison {
 public:
  // The step of a frame on the state of its start: the reference's, which no oracle knows.
  using ReferenceStep = std::function<void(const Setup& setup, State& state)>;
  // `setup` must outlive this.
  StepComparison(const Setup& setup, ReferenceStep reference_step);

  // `before`: the backend's state before the step of frame before.frame, `after`: after it. Both well formed.
  StepDifference compare(const State& before, const State& after);

 private:
  struct Stepped {
    State state;
    std::vector<uint8_t> tied;  // [n] 1: in the blade's plane, up to rounding, when some substep began
    int64_t led = 0;            // particles that were moved across the plane
  };
  // `starts`: of each substep, if wanted.
  Stepped step(const State& before, const std::vector<int8_t>& wanted, std::vector<State>* starts = nullptr);
  struct OnTheWay {
    std::vector<uint8_t> turning;    // [m] 1: the rotation is nearly not unique, and moves its members
    std::vector<uint8_t> bordering;  // [n] 1: over a side of the blade's rectangle
  };
  OnTheWay open_on_the_way(const State& before, const std::vector<int8_t>& wanted);
  // How far positions [n] and rotations [m], as displacements, are carried by roundings of the start [h].
  struct Growth {
    std::vector<double> position, turn;
  };
  Growth growth_of_rounding(const State& before, const State& expected, const std::vector<int8_t>& wanted);

  const Setup& setup_;
  ReferenceStep reference_step_;
  double bound_;       // [h]
  Setup one_substep_;  // scratch: a setup of a single frame of a single substep
};

}  // namespace cutproof::oracles
