#include "tuning/comparison.h"

#include <algorithm>
#include <utility>

namespace cutproof::tuning {

void Comparison::add(const State& state) {
  oracles::add_pose(trajectory_.frames, setup_, state);
  compare(trajectory_.frames.size() - 1);
}

void Comparison::add(Trajectory run) {
  trajectory_ = std::move(run);
  for (std::size_t f = 0; f < trajectory_.frames.size(); ++f) compare(f);
}

void Comparison::compare(std::size_t f) {
  if (f >= reference_.frames.size()) return;
  const oracles::Apart apart = oracles::poses_apart(setup_, reference_.frames[f], trajectory_.frames[f]);
  const double rms = apart.position.rms();
  if (!(rms <= allowed_) && !beyond()) trial_.first_beyond = f;
  trial_.rms_h.push_back(rms);
  trial_.greatest_rms_h = std::max(trial_.greatest_rms_h, rms);
  trial_.greatest_h = std::max(trial_.greatest_h, apart.position.max);
  trial_.removed_otherwise = apart.alive_in_one;
}

}  // namespace cutproof::tuning
