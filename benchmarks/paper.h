// Measurements of the paper (Yu et al. 2024; Intel i7 10700F, Nvidia RTX 2060), and their scenes in fixtures/scenes.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/scene.h"
#include "fixtures/build.h"
#include "model/scene.h"
#include "model/stage.h"

namespace cutproof::benchmarks {

// A column of Table 1; or the irregular path of Fig. 13, for which the paper has no times.
struct PaperScene {
  std::string name;                            // of the column
  std::string file;                            // the scene in fixtures/scenes that restates the figure
  std::optional<int64_t> particles, clusters;  // only the kidney's are published: its frame is the last row of Table 2
  // Our number of particles at full size. Where the paper's is unknown: a size between those of Tables 2 and 3 whose
  // times per frame enclose the scene's (cuboid: 12,800 particles in 20.2 ms, 37,704 in 42.1; liver: 63,649 in 48.34,
  // 101,096 in 59.75).
  int64_t full_particles = 0;
  int64_t small_particles = 0;  // for a quick run
  struct Milliseconds {
    std::array<double, 6> stage = {};  // in the order of the stages
    double frame = 0;                  // less than the stages' sum, because the paper overlaps stages
  };
  std::optional<Milliseconds> paper;
  // Of `frame` or of a stage by its name; empty if not published.
  std::optional<double> paper_ms(const std::string& what) const;
  bool sampled_only = false;  // the figure is about clusters that leave edges uncovered
};
// cuboid, liver, kidney, irregular. find: null if the name is unknown.
const std::vector<PaperScene>& paper_scenes();
const PaperScene* find_paper_scene(const std::string& name);

// A row of Table 2: a kidney's discontinuous cut. Or the size that only Table 3 has, without a number of clusters,
// which is not published.
struct PaperSampling {
  int64_t particles = 0;
  std::optional<int64_t> clusters;
  double frame_ms = 0;
};
// Those of Table 2 first.
const std::vector<PaperSampling>& paper_samplings();

// Fig. 10: the growth of the number of clusters during a cut.
inline constexpr double kPaperGrowth = 0.01;

// A scene embedded in the program, by its file's name without the ending (benchmarks/CMakeLists.txt). Throws
// std::out_of_range for other scenes.
Scene embedded_scene(const std::string& file);

// A scene with so many particles. `sampled`: balls that do not cover every edge, with the paper's expansion in every
// frame that removes something. There are as many balls as the paper has clusters, unless the scene gives their size.
// The timed frames are around the middle of the last stroke. Throws InputError if fewer frames than wanted follow the
// beginning of that stroke.
BenchScene make_paper_scene(const std::string& file, const std::string& name, int64_t particles, Cooking cooking,
                            int64_t frames);

}  // namespace cutproof::benchmarks
