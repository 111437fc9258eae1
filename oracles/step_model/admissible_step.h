// Whether a step ends within rounding of the method, judged from its first and last state. Where rounding explains both
// answers of a decision, everything coupled with it is inconclusive (docs/design/tolerances.md, The step again).
// Backends that show iterates are judged more sharply: oracles/iterates/. Internal to oracles/.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"
#include "oracles/registry.h"
#include "oracles/step_model/step_model.h"

namespace cutproof::oracles {

// The compared quantities of a step, each with its own bounds. `own`: less what its clusters share
// (StepModel::without_shared).
enum class StepPart { position, velocity, rotation, impulse, own_position, own_velocity };
constexpr const char* name_of(StepPart part) {
  constexpr const char* kNames[] = {"position", "velocity", "rotation", "impulse", "own position", "own velocity"};
  return kNames[static_cast<int>(part)];
}

struct AdmissibleStep {
  StepOutcome outcome;  // of exact arithmetic
  // The comparison that comes nearest to its bound, or goes farthest beyond.
  StepPart part = StepPart::position;
  int32_t where = -1;   // particle; of a rotation, index of the cluster; of the impulse -1
  double measured = 0;  // [h]; velocities times dt, rotations by where they put the farthest member, impulses times dt
  double bound = 0;     // [h]               / M
  bool holds = true;
  int64_t checked = 0;
  int64_t otherwise = 0;  // rotations that the step had to choose, and that are followed
  // Particles and rotations of which no sharp answer could be asked: rounding carries them farther than any rule of
  // small changes holds, or decisions are open on which they hang. They lie within what rounding, or those decisions,
  // can do.
  int64_t inconclusive = 0;
  std::vector<double> position_bound;  // [n] effect of rounding on the outcome [h]
  std::vector<double> velocity_bound;  // [n] the same, times dt [h]
  std::vector<double> rotation_bound;  // [m] the same, where it puts the farthest member [h]
  std::vector<double> reach;           // [m] of the farthest member from the center at rest, or 1 if that is less [h]
};

// `before` and `after`: well formed, of the same clusters; `before` finite, its schedule not over. `known_rotations`:
// as StageRun has it; one that is not known is not judged, and counts as inconclusive; one that is gone is not
// asked for. `at_once`: threads for disturbed
// runs; 0: one, or where runs are long one for each processor. The answer is the same with any number.
AdmissibleStep nearest_admissible_step(const Setup& setup, const State& before, const State& after,
                                       std::span<const RotationKnown> known_rotations = {}, int at_once = 0);

// The same with its verdict, of any two well-formed states; without the step where none can be computed.
struct StepAgain {
  Verdict verdict;
  std::optional<AdmissibleStep> step = {};
};
StepAgain step_again(const Setup& setup, const State& before, const State& after,
                     std::span<const RotationKnown> known_rotations = {});

}  // namespace cutproof::oracles
