// A backend's run beside the reference, in lockstep: before each stage the reference takes the backend's state, then
// both run the stage (measure_and_tune.md, Implementation). Errors are those of one frame, and a decision within its
// rounding band does not spread to the next stage.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"
#include "oracles/comparison/stage_comparison.h"

namespace cutproof::harness {

// One frame in lockstep.
struct LockstepFrame {
  int64_t frame = 0;
  oracles::ErrorNorm angle;                  // of rotations [rad]
  std::array<oracles::ErrorNorm, 6> errors;  // by Measure; rest frames only if clusters have changed
  int64_t topology_differences = 0;          // stages with different decisions
  oracles::Undecidable undecidable;

  oracles::ErrorNorm& error(oracles::Measure which) { return errors[at(which)]; }
  const oracles::ErrorNorm& error(oracles::Measure which) const { return errors[at(which)]; }
};

// The worst of one measure over the run so far.
struct LockstepWorst {
  oracles::ErrorNorm norm;  // of all frames
  double bound = 0;         // the greatest; each stage is held against its own
  int64_t frame = 0;
  Stage stage = Stage::step;
};

class Lockstep {
 public:
  // `start` is what was loaded, `loaded` the backend's first snapshot. `setup` must outlive this.
  Lockstep(const Setup& setup, const State& start, const State& loaded, std::string backend);

  // The backend's state after `stage`, of every stage of every frame, in order; whether the backend launched it.
  // A state that is not well formed is a difference, and ends the comparison. `by_backend`: false of a stage that the
  // reference ran for the backend: it is passed over.
  void see(Stage stage, const State& after, bool launched, bool by_backend = true);

  // Registers a listener of the reference's answers to the backend's states, for every stage that the backend launched.
  void observe_reference(std::function<void(Stage, const State&)> observer) { observer_ = std::move(observer); }

  // One verdict for each thing that was measured, over the whole run so far (json.md, Comparison with the
  // reference).
  std::vector<Verdict> verdicts() const;

  const std::vector<LockstepFrame>& frames() const { return frames_; }
  const LockstepWorst& worst(oracles::Measure which) const { return tracks_[at(which)].worst; }

 private:
  // Data of one verdict, except the number of checks.
  struct Failures {
    Verdict first;
    int64_t count = 0;
    void add(Verdict failure) {
      if (count++ == 0) first = std::move(failure);
    }
  };
  struct Track {
    LockstepWorst worst;
    Failures failures;
  };

  void note(oracles::Measure which, Stage stage, const oracles::MeasuredError& error, oracles::ErrorNorm& of_frame);
  void differ(Stage stage, const oracles::DecisionDifference& difference);

  const Setup& setup_;
  std::string backend_;
  int64_t frame_ = 0;    // in progress
  State before_;         // the backend's last snapshot
  bool broken_ = false;  // a snapshot could not be read: nothing can be compared any more
  oracles::StageComparison comparison_;
  std::function<void(Stage, const State&)> observer_;  // may be empty
  std::vector<LockstepFrame> frames_;
  std::array<Track, 6> tracks_;
  Failures topology_, removals_, steps_failed_;
  int64_t stages_ = 0, detections_ = 0, steps_ = 0;  // that were compared
};

}  // namespace cutproof::harness
