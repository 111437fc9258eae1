// How far a backend goes from a reference solution, frame by frame.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "tuning/trajectory.h"
#include "tuning/trial.h"

namespace cutproof::tuning {

class Comparison {
 public:
  // `allowed`: the RMS distance up to which a frame is within [h]. `setup` and `reference` must outlive it.
  Comparison(const Setup& setup, const Trajectory& reference, double allowed)
      : setup_(setup), reference_(reference), allowed_(allowed) {}

  // The state at the end of the next frame of the scene.
  void add(const State& state);
  bool beyond() const { return first_beyond_.has_value(); }
  void report(Trial& trial) const;
  Trajectory& trajectory() { return trajectory_; }

 private:
  const Setup& setup_;
  const Trajectory& reference_;
  double allowed_;
  Trajectory trajectory_;
  std::vector<double> rms_h_;
  std::optional<std::size_t> first_beyond_;
  double greatest_h_ = 0;
  int64_t removed_otherwise_ = 0;
};

}  // namespace cutproof::tuning
