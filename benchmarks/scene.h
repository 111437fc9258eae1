// Bodies that a blade is cutting while they are timed.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "model/scene.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::benchmarks {

struct ReadyScene {
  std::string name;
  Setup setup;
  State state;  // before frame 0
};

// A body that a blade is cutting, named by shape and particles, at rest before frame 0. From frame `warm_up` on, for as
// many frames as were asked for and kJudgedFrames more, the blade's edge is inside the tissue and moves on.
struct BenchScene : ReadyScene {
  int64_t warm_up = 0;       // frames until the cut is well under way
  double advance = 0;        // of the blade's edge in one frame [h]
  double build_seconds = 0;  // sampling and cooking
  Cooking cooking = Cooking::boxes;
};

// The most frames that are judged after the timed ones: until one of them has removed something.
inline constexpr int64_t kJudgedFrames = 4;

// `boxes` or `sampled`; throws InputError, naming --clusters, for anything else.
Cooking cooking_of(const std::string& name);

// Sampled clusters as the paper's: as many balls as it has clusters (795 of 101,096 particles; ours 789 of 101,056),
// which do not cover every edge, because a ball's seed may lie next to another ball, and its expansion.
void sample_as_paper(Scene& spec);

// A box up to kLargestBox particles, a kidney beyond; 4 substeps × 4 plain iterations; k = 1e5; the blade enters at the
// upper end of the longest axis and follows it, halfway between two layers of nodes. The other end is held. Throws
// InputError if no body has so many particles, within 2 %.
inline constexpr int64_t kLargestBox = 2000;
BenchScene make_bench_scene(int64_t particles, int64_t frames, Cooking cooking = Cooking::boxes);

// Throws InputError, naming --sizes, for a number of particles that cannot be timed.
void require_timed_sizes(const std::vector<int64_t>& sizes);

}  // namespace cutproof::benchmarks
