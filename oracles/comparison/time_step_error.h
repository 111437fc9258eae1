// The error of the time step. Figures, not verdicts (measure_and_tune.md, Time step). Lengths are in h, the spacing of
// the grid; broken data and NaN have an infinite error.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "model/backend.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::oracles {

// The same scene with `factor` times the substeps: frames, iterations per substep and paths stay as they are, each move
// of the blade and of a grip is divided into equal parts. Requires factor >= 1.
Setup with_more_substeps(const Setup& setup, int32_t factor);

using MakeBackend = std::function<std::unique_ptr<Backend>()>;

// Two free runs at equal times, up to the first removal that differs.
struct TimeStepError {
  std::vector<ErrorNorm> position;           // [compared frames] of alive particles at the end of the frame [h]
  std::optional<int64_t> first_difference;   // the frame whose removals differ; the last one that was run
  std::optional<int32_t> removed_otherwise;  // a particle that only one of the two removed in it
  double greatest_rms() const;
};
TimeStepError time_step_error(const MakeBackend& make, const Setup& setup, const State& state, int64_t frames,
                              int32_t factor = 8);

}  // namespace cutproof::oracles
