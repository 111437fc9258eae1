// Bodies for timing while a blade cuts them.
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

// A body under a blade that cuts, named by shape and particles, at rest before frame 0. From frame `warm_up` on the
// blade's edge moves inside the tissue, for as many frames as requested and kJudgedFrames more.
struct BenchScene : ReadyScene {
  int64_t warm_up = 0;       // frames before the timed ones
  double advance = 0;        // of the blade's edge in one frame [h]
  double build_seconds = 0;  // sampling and cooking
  Cooking cooking = Cooking::boxes;
};

// Most frames judged after the timed ones; judging ends with a frame that has removed something.
inline constexpr int64_t kJudgedFrames = 4;

// `boxes` or `sampled`; throws InputError, naming --clusters, for anything else.
Cooking cooking_of(const std::string& name);

// The paper's sampled clusters and its expansion: as many balls as it has clusters (795 of 101,096 particles; ours 789
// of 101,056). They do not cover every edge, because a ball's seed may lie next to another ball.
void sample_as_paper(Scene& spec);

// A box up to kLargestBox particles, a larger body is a kidney; 4 substeps × 4 plain iterations; k = 1e5. The blade
// enters at the upper end of the longest axis and follows it, halfway between two layers of nodes. The other end is
// held. Throws InputError if no body has so many particles, within 2 %.
inline constexpr int64_t kLargestBox = 2000;
BenchScene make_bench_scene(int64_t particles, int64_t frames, Cooking cooking = Cooking::boxes);

// Throws InputError, naming --sizes, for a number of particles that cannot be timed.
void require_timed_sizes(const std::vector<int64_t>& sizes);

}  // namespace cutproof::benchmarks
