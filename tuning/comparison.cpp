#include "tuning/comparison.h"

#include <algorithm>

namespace cutproof::tuning {

void Comparison::add(const State& state) {
  const std::size_t f = trajectory_.frames.size();
  trajectory_.frames.push_back(oracles::pose_of(setup_, state, f == 0 ? nullptr : &trajectory_.frames.back()));
  if (f >= reference_.frames.size()) return;
  const oracles::Apart apart = oracles::poses_apart(setup_, reference_.frames[f], trajectory_.frames.back());
  const double rms = apart.position.rms();
  if (!(rms <= allowed_) && !beyond()) trial_.first_beyond = f;
  trial_.rms_h.push_back(rms);
  trial_.greatest_rms_h = std::max(trial_.greatest_rms_h, rms);
  trial_.greatest_h = std::max(trial_.greatest_h, apart.position.max);
  trial_.removed_otherwise = apart.alive_in_one;
}

}  // namespace cutproof::tuning
