// Timing of frames and stages.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/scene.h"
#include "benchmarks/times.h"
#include "model/backend.h"

namespace cutproof::benchmarks {

inline constexpr Span kWholeFrame = {Stage::step, Stage::skin};

// Times of one backend on one scene. All three passes start from the same state, so they see the same frames.
struct Timings {
  Times frame;                 // whole frames, each waited for
  Times cutting;               // those that removed something
  Times back_to_back;          // per frame, launched without waiting; one per repeat
  std::array<Times, 6> stage;  // spans of one stage; only frames in which the stage ran

  // `frame`, `frame, cutting`, `back to back` if timed, and the stages.
  std::vector<std::pair<std::string, Times>> named() const;
};
// Every pass `repeats` times, each after a warm-up of its own. back_to_back only if `pipelined`, for backends whose
// run() does not wait. Leaves the backend at the end of the timed frames.
Timings time_stages(Backend& backend, const BenchScene& scene, int64_t frames, bool pipelined, int64_t repeats = 1);

// Memberships that expansion adds in the timed frames. Leaves the backend at their end.
int64_t count_added_memberships(Backend& backend, const BenchScene& scene, int64_t frames);

}  // namespace cutproof::benchmarks
