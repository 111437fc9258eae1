// A stage of a backend beside the reference's from the same state: the one comparison with the reference, which
// lockstep, the property tests and the benchmarks share (docs/design/tolerances.md, Against the reference).
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"
#include "oracles/comparison/state_difference.h"

namespace cutproof::oracles {

// The reference's stages, in the order of kStages, which no oracle knows by itself: each takes a state before the
// stage, which is due, and leaves the one after it. The end of the frame after skin is no part of them.
using ReferenceStages = std::array<std::function<void(const Setup& setup, State& state)>, 6>;

// Greatest extent of the body at rest, over the three axes [h].
double body_extent(const Body& body);

// Required accuracy of positions after a step [h]; velocities [h/dt] may err by twice that, because each is the
// difference of two positions.
double position_bound(const Body& body);

// Inconclusive differences, where rounding explains both answers: counted, and not measured where they exceed the
// required accuracy of positions.
struct Undecidable {
  int64_t removals = 0;      // particles removed by one only, within the rounding band of detection
  int64_t otherwise = 0;     // decisions of steps that the backend has taken, within rounding, as the reference has not
  int64_t positions = 0;     // particles that the rounding of a step carries farther than a bound, or makes faster
  int64_t rotations = 0;     // clusters, the same
  int64_t inconclusive = 0;  // of positions: too far for a sharp bound (Verdict::inconclusive)

  void join(const Undecidable& other);
};

// The measures, each with its own bound.
enum class Measure { position, velocity, rotation, rest_center, mass, skin };
struct MeasureInfo {
  std::string_view name;  // of the property
  std::string_view key;   // in files
  std::string_view unit;
  bool of_clusters;  // `where` is the index of a cluster; otherwise a particle
};
inline constexpr std::array<MeasureInfo, 6> kMeasures = {{{"positions", "position", "h", false},
                                                          {"velocities", "velocity", "h/dt", false},
                                                          {"rotations", "rotation", "h", true},
                                                          {"rest centers", "rest_center", "h", true},
                                                          {"masses", "mass", "1", true},
                                                          {"skin vertices", "skin", "h", false}}};
constexpr const MeasureInfo& info_of(Measure which) { return kMeasures[static_cast<std::size_t>(which)]; }

// An empty norm holds: nothing was measured.
struct MeasuredError {
  ErrorNorm norm;
  double bound = 0;
  bool holds() const { return norm.count == 0 || norm.max <= bound; }
};

// Comparison of one stage of a backend with the reference's.
struct StageDifference {
  Stage stage = Stage::step;
  int64_t frame = 0;
  bool is_readable = true;  // `after` is well formed; otherwise decisions.front() says why, and there is nothing else
  bool due = false;
  State expected;  // the reference's answer to the same state; inconclusive removals are the backend's
  // Whether the stage ran exactly if it was due, and then the first decision that differs; at most one of each.
  std::vector<DecisionDifference> decisions;
  bool sets_are_open = false;        // the rule leaves several answers, so clusters are not among them
  std::vector<int32_t> removals;     // detect: particles that only one of the two removes
  std::optional<Verdict> detection;  // where there are some: the oracle's, whether each lies within its rounding band
  std::optional<Verdict> step;       // of a step that was due: the oracle's, whether it is admissible
  Undecidable undecidable;
  ErrorNorm angle;                           // of rotations [rad]
  std::array<MeasuredError, 6> errors = {};  // by Measure

  MeasuredError& error(Measure which) { return errors[static_cast<std::size_t>(which)]; }
  const MeasuredError& error(Measure which) const { return errors[static_cast<std::size_t>(which)]; }

  // One for decisions (`topology`), one for removals where the stage is a detection that was due, one for a step that
  // was due (`admissible step`), one for each measure that was taken. Their properties begin with `prefix`.
  std::vector<Verdict> verdicts(const std::string& prefix) const;
};

// The verdict on one measure after a stage of a frame, as in StageDifference::verdicts.
Verdict verdict_of(Measure which, const MeasuredError& error, Stage stage, int64_t frame, const std::string& prefix);

// Compares stages of one body, one after the other.
class StageComparison {
 public:
  // `setup` must outlive this.
  StageComparison(const Setup& setup, ReferenceStages reference);

  // `before` and `after`: the backend's states around the stage of frame before.frame; `before` well formed.
  // `launched`: whether the backend ran the stage. An `after` that is not well formed is itself the difference, and
  // nothing else is compared.
  StageDifference compare(Stage stage, const State& before, const State& after, bool launched);

 private:
  void compare_step(const State& before, const State& after, StageDifference& found);
  void compare_later_stage(const State& before, const State& after, bool launched, StageDifference& found);

  const Setup& setup_;
  ReferenceStages reference_;
};

// Rest centers and masses of `state` against those that its own memberships give, with their bounds.
struct RestFrameComparison {
  MeasuredError center, mass;
};
RestFrameComparison compare_rest_frames(const Setup& setup, const State& state);

// Particles that stand in one of two ascending lists only.
std::vector<int32_t> in_one_only(const std::vector<int32_t>& a, const std::vector<int32_t>& b);

}  // namespace cutproof::oracles
