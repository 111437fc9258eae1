// Pieces of `cutproof bench stages`: what is timed, how errors are found, and the bytes that the step must move.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/bench/report.h"
#include "model/backend.h"
#include "model/verdict.h"

namespace cutproof::cli {

// A body that a blade is cutting. From frame `warm_up` on, for as many frames as were asked for and kJudgedFrames
// more, the blade's edge is inside the tissue and moves on.
struct BenchScene {
  std::string name;  // shape and particles
  Setup setup;
  State state;               // at rest, before frame 0
  int64_t warm_up = 0;       // frames until the cut is well under way
  double advance = 0;        // of the blade's edge in one frame [h]
  double build_seconds = 0;  // sampling and cooking
};

// The most frames that are judged after the timed ones: until one of them has removed something.
inline constexpr int64_t kJudgedFrames = 4;

// A box up to kLargestBox particles, a kidney beyond; `boxes` clusters; 4 substeps × 4 iterations; k = 1e5; the blade
// enters at the upper end of the longest axis and follows it, halfway between two layers of nodes. The other end is
// held. Throws InputError if no body has so many particles, within 2 %.
inline constexpr int64_t kLargestBox = 2000;
BenchScene make_bench_scene(int64_t particles, int64_t frames);

// What timing one backend on one scene gives. All three passes start from the same state, so they see the same frames.
struct Timings {
  Times frame;                         // whole frames, each waited for
  Times cutting;                       // those of them that removed something
  std::optional<double> back_to_back;  // [s] per frame, when the frames are handed over without waiting for any
  std::array<Times, 6> stage;          // spans of one stage; only frames in which the stage ran
};
// back_to_back only if `pipelined`, for backends whose run() does not wait.
Timings time_stages(Backend& backend, const BenchScene& scene, int64_t frames, bool pipelined);

// Distances of a backend's points from the reference's, from the same state.
struct Distances {
  double max = 0, rms = 0;  // [h]
  int64_t beyond = 0;       // points farther than 1e-4 h
};
// One frame in lockstep: each stage of the backend against the reference's from the backend's state before it. Where
// no frame of those judged had a stage due, its entry is empty.
struct FrameErrors {
  int64_t frames = 0;  // that were judged
  std::optional<Distances> step;
  struct Detection {
    int64_t removed = 0, differing = 0;  // particles; differing: removed by one of the two only
    bool within_rounding = true;         // oracle `detection`: every decision outside the rounding band is right
  };
  std::optional<Detection> detect;
  std::array<std::optional<bool>, 6> clusters_equal;  // split, merge, expand: same clusters, same numbers
  struct Surface {
    Distances vertices;
    bool triangles_equal = true;  // as sets; vertices named by owner and direction
  };
  std::optional<Surface> skin;
  std::vector<Verdict> topology;  // of the state after the last judged frame, by the oracles that cost little
  bool topology_holds() const;
};
// Runs and judges frames of what `backend` has loaded until one of them has removed something, at most kJudgedFrames.
FrameErrors judge_frames(Backend& backend, const Setup& setup);

// Bytes that the kernels of one frame's step read and write, with each array counted once for each kernel that uses
// it, and what the caches keep of a gathered array counted as if it were all of it (docs/results_schema.md, The floor
// of step). `launches`: kernels one after the other.
struct StepFloor {
  double bytes = 0;
  int64_t launches = 0;
};
StepFloor step_floor(const Setup& setup, const State& state);

}  // namespace cutproof::cli
