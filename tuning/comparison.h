// Distances of a backend from a reference solution, frame by frame.
#pragma once
#include "model/setup.h"
#include "model/state.h"
#include "tuning/trajectory.h"
#include "tuning/trial.h"

namespace cutproof::tuning {

class Comparison {
 public:
  // `allowed`: the greatest RMS distance of a frame within the tolerance [h]. Distances go to `trial`. `setup`,
  // `reference` and `trial` must outlive it.
  Comparison(const Setup& setup, const Trajectory& reference, double allowed, Trial& trial)
      : setup_(setup), reference_(reference), allowed_(allowed), trial_(trial) {}

  // `state`: at the end of the next frame of the scene.
  void add(const State& state);
  // A whole run, instead of single frames.
  void add(Trajectory run);
  bool beyond() const { return trial_.first_beyond.has_value(); }
  Trajectory& trajectory() { return trajectory_; }

 private:
  void compare(std::size_t frame);

  const Setup& setup_;
  const Trajectory& reference_;
  double allowed_;
  Trial& trial_;
  Trajectory trajectory_;
};

}  // namespace cutproof::tuning
