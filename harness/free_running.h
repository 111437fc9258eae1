// A backend and the reference that start alike and run freely, until the first decision in which they differ
// (measure_and_tune.md, Implementation).
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"
#include "oracles/comparison/state_difference.h"

namespace cutproof::harness {

// One frame, at the end of its step.
struct FreeFrame {
  int64_t frame = 0;
  oracles::ErrorNorm position;  // [h]
};

// The first decision in which the two runs differ.
struct FirstDifference {
  int64_t frame = 0;
  Stage stage = Stage::step;
  oracles::DecisionDifference what;
  // Distance criterion, removals: the greatest margin of a particle that only one run removed, in the reference's
  // positions. The margin is |d_i - εh| / h. If one end of each edge is removed, the margin is the least such distance
  // of an edge or of a side of the blade's plane. Second, the possible difference of the margin, given the distance of
  // the positions.
  std::optional<double> margin;
  double reach = 0;  // [h]
  // Both may be right: the backend's removals are those that its own positions ask for and the margin is within reach,
  // or the rule leaves several answers.
  bool explained = false;
};

class FreeRunning {
 public:
  // `start` is what was loaded, `loaded` the backend's first snapshot. `setup` must outlive this.
  FreeRunning(const Setup& setup, const State& start, const State& loaded, std::string backend);

  // Registers a listener of the reference's state after each stage, up to the first decision that differs.
  void observe_reference(std::function<void(Stage, const State&)> observer) { observer_ = std::move(observer); }

  // The backend's state after `stage`, of every stage of every frame, in order. A state that is not well formed is a
  // difference.
  void see(Stage stage, const State& after);

  // "free-running: decisions"; see json.md, Comparison with the reference.
  Verdict verdict() const;

  const std::vector<FreeFrame>& frames() const { return frames_; }
  const std::optional<FirstDifference>& first_difference() const { return first_difference_; }

 private:
  FirstDifference& end_with(Stage stage, oracles::DecisionDifference what);

  const Setup& setup_;
  std::string backend_;
  int64_t frame_ = 0;                                  // in progress
  State before_;                                       // the backend's last snapshot
  std::unique_ptr<Backend> reference_;                 // null once the runs differ
  std::function<void(Stage, const State&)> observer_;  // may be empty
  std::vector<FreeFrame> frames_;
  std::optional<FirstDifference> first_difference_;
};

}  // namespace cutproof::harness
