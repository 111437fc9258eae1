#include "oracles/comparison/time_step_error.h"

#include <algorithm>

#include "oracles/blade_motion.h"
#include "oracles/comparison/measurable.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/support.h"

namespace cutproof::oracles {

Setup with_more_substeps(const Setup& setup, int32_t factor) {
  Setup finer = setup;
  finer.step.substeps *= factor;
  for (double& dt : finer.substep_length) dt /= factor;
  finer.blade_moves.clear();
  for (const BladeMove& move : setup.blade_moves) {
    for (int32_t part = 0; part < factor; ++part) {
      const auto pose = [&](int32_t k) { return pose_between(move.from, move.to, static_cast<double>(k) / factor); };
      finer.blade_moves.push_back({pose(part), pose(part + 1), move.down, move.stroke});
    }
  }
  for (Grip& grip : finer.grips) {
    const Grip whole = std::move(grip);
    grip = Grip{whole.particles, {}, {}};
    for (std::size_t k = 0; k < whole.active.size(); ++k) {
      grip.active.insert(grip.active.end(), at(factor), whole.active[k]);
      grip.displacement.insert(grip.displacement.end(), at(factor), whole.displacement[k] / factor);
    }
  }
  return finer;
}

double TimeStepError::greatest_rms() const {
  double greatest = 0;
  for (const ErrorNorm& frame : position) greatest = std::max(greatest, frame.rms());
  return greatest;
}

TimeStepError time_step_error(const MakeBackend& make, const Setup& setup, const State& state, int64_t frames,
                              int32_t factor) {
  const std::unique_ptr<Backend> coarse = make(), fine = make();
  coarse->load({setup}, {state});
  fine->load({with_more_substeps(setup, factor)}, {state});
  TimeStepError error;
  for (int64_t frame = state.frame; frame < std::min(state.frame + frames, setup.frame_count()); ++frame) {
    coarse->run({});
    fine->run({});
    const State a = std::move(fine->snapshot().front()), b = std::move(coarse->snapshot().front());
    if (!measurable(setup, a) || !measurable(setup, b)) {
      error.position.push_back(infinite_error());
      break;
    }
    for (std::size_t i = 0; i < a.alive.size() && !error.first_difference; ++i) {
      if (a.alive[i] == b.alive[i]) continue;
      error.first_difference = frame;
      error.removed_otherwise = static_cast<int32_t>(i);
    }
    if (error.first_difference) break;
    error.position.push_back(position_error(setup, a.x, b.x, a.alive));
  }
  return error;
}

}  // namespace cutproof::oracles
