#include "tuning/comparison.h"

#include <algorithm>

namespace cutproof::tuning {

void Comparison::add(const State& state) {
  const std::size_t f = trajectory_.frames.size();
  trajectory_.frames.push_back(oracles::pose_of(setup_, state, f == 0 ? nullptr : &trajectory_.frames.back()));
  if (f >= reference_.frames.size()) return;
  const oracles::Apart apart = oracles::poses_apart(setup_, reference_.frames[f], trajectory_.frames.back());
  rms_h_.push_back(apart.position.rms());
  if (!(rms_h_.back() <= allowed_) && !first_beyond_) first_beyond_ = f;
  greatest_h_ = std::max(greatest_h_, apart.position.max);
  removed_otherwise_ = apart.alive_in_one;
}

void Comparison::report(Trial& trial) const {
  trial.rms_h = rms_h_;
  trial.greatest_rms_h = rms_h_.empty() ? 0 : *std::max_element(rms_h_.begin(), rms_h_.end());
  trial.first_beyond = first_beyond_;
  trial.greatest_h = greatest_h_;
  trial.removed_otherwise = removed_otherwise_;
}

}  // namespace cutproof::tuning
