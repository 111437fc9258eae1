// `cutproof run --against reference`: a backend's run, stage by stage, beside the reference's (accuracy_and_speed.md
// §1).
//
// Lockstep: before each stage the reference takes the backend's state, then both run the stage. What is measured is
// the error of one frame; and a decision that falls within its rounding band does not spread to the next stage.
// Shadow: both start alike and run freely, until the first decision in which they differ.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/state_difference.h"

namespace cutproof::cli {

using oracles::Difference;
using oracles::greatest_neighbour_distance;
using oracles::positions_apart;
using oracles::rest_frames_apart;
using oracles::RestFrameSpread;
using oracles::skins_apart;
using oracles::Spread;
using oracles::topological_difference;
using oracles::velocities_apart;

enum class AgainstMode { lockstep, shadow, both };

// One frame in lockstep. "Either" is what rounding decides, so that both answers are right; it is counted and not
// measured.
struct LockstepFrame {
  int64_t frame = 0;
  Spread position, velocity;          // [h], [h / dt]
  Spread angle, rotation;             // [rad], and as displacements [h]
  Spread rest_center, mass;           // [h], [1]; only if clusters have changed
  Spread skin;                        // [h]
  int64_t topology_differences = 0;   // stages that differ in what must be equal
  int64_t removals_either = 0;        // removed by one only, within the rounding band
  int64_t sides_either = 0;           // particles in the blade's plane at the start of a substep
  int64_t sides_taken_otherwise = 0;  // of these: the reference was led to the backend's side
  int64_t rotations_either = 0;       // clusters whose rotation is not unique, and differs
  int64_t sensitive_either = 0;       // particles beyond the bound that one rounding of the start carries as far
  int64_t particles_excluded = 0;     // from position and velocity, for any of these reasons
};

// One frame of both running freely, at the end of its step.
struct ShadowFrame {
  int64_t frame = 0;
  Spread position;  // [h]
};

// The first decision in which two free runs differ.
struct FirstDifference {
  int64_t frame = 0;
  Stage stage = Stage::step;
  Difference what;
  // Distance criterion, removals: greatest |d_i - εh| / h of the particles that only one of them removed, in the
  // reference's positions, and by how much their d_i may differ, given how far the positions are apart.
  std::optional<double> margin;
  double reach = 0;  // [h]
  // Both may be right: the backend's removals are those that its own positions ask for and the margin is within reach,
  // or the rule leaves several answers.
  bool explained = false;
};

class Against {
 public:
  // `start` is what was loaded, `loaded` the backend's first snapshot.
  // `setup` must outlive this.
  Against(const Setup& setup, const State& start, const State& loaded, std::string backend, AgainstMode mode);

  // The backend's state after `stage`, of every stage of every frame, in order; whether the backend launched it.
  void see(Stage stage, const State& after, bool launched);

  // One verdict for each thing that was measured, over the whole run so far; see docs/results_schema.md.
  std::vector<Verdict> verdicts() const;
  bool holds() const;

  AgainstMode mode() const { return mode_; }
  const std::vector<LockstepFrame>& lockstep() const { return lockstep_; }
  const std::vector<ShadowFrame>& shadow() const { return shadow_; }
  const std::optional<FirstDifference>& first_difference() const { return first_difference_; }
  double position_bound() const { return position_bound_; }  // [h]

  // All but the verdicts.
  nlohmann::json to_json() const;

 private:
  enum Measure { position, velocity, rotation, rest_center, mass, skin, kMeasures };
  // What one verdict is made from.
  struct Track {
    Spread all;
    int64_t worst_frame = 0;
    Stage worst_stage = Stage::step;
    std::optional<Verdict> failure;  // the first
    int64_t failures = 0;
  };

  void see_lockstep(Stage stage, const State& after, bool launched);
  void see_shadow(Stage stage, const State& after);
  void compare_step(const State& after, LockstepFrame& frame);
  void adopt_removals_within_band(const State& after, State& expected, LockstepFrame& frame);
  void differ(Stage stage, const Difference& difference);
  double bound_of(Measure which) const;
  void note(Measure which, Stage stage, const Spread& spread, Spread& of_frame);
  void judge_rest_frames(Stage stage, const State& after, LockstepFrame& frame);

  const Setup& setup_;
  std::string backend_;
  AgainstMode mode_;
  double position_bound_ = 0;
  int64_t frame_ = 0;    // in progress
  State before_;         // the backend's last snapshot
  bool broken_ = false;  // a snapshot could not be read: nothing can be compared any more

  std::optional<oracles::StepComparison> comparison_;
  std::unique_ptr<Backend> reference_;
  std::vector<LockstepFrame> lockstep_;
  std::array<Track, kMeasures> tracks_;
  std::optional<Verdict> topology_failure_, detection_failure_;
  int64_t stages_compared_ = 0, detections_compared_ = 0, topology_failures_ = 0, detection_failures_ = 0;
  int64_t largest_cluster_ = 0;

  std::unique_ptr<Backend> free_reference_;  // null once the runs differ
  std::vector<ShadowFrame> shadow_;
  std::optional<FirstDifference> first_difference_;
};

// The table, the verdicts and the first difference, for a person.
void print_against(const Against& against);

}  // namespace cutproof::cli
