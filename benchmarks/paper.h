// What Yu et al. 2024 measured (Intel i7 10700F, Nvidia RTX 2060), and the scenes that they measured it on, as
// fixtures/scenes has them.
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

// A column of Table 1; or the irregular path of Fig. 13, which the paper shows and does not time.
struct PaperScene {
  std::string name;                            // of the column
  std::string file;                            // the scene in fixtures/scenes that restates the figure
  std::optional<int64_t> particles, clusters;  // known for the kidney alone: its frame is the last row of Table 2
  // Ours at full size. Where the paper's is not known: a size between those of Tables 2 and 3 whose times per frame
  // enclose the scene's (cuboid: 12,800 particles in 20.2 ms, 37,704 in 42.1; liver: 63,649 in 48.34, 101,096
  // in 59.75).
  int64_t full_particles = 0;
  int64_t small_particles = 0;  // where nobody wants to wait
  struct Milliseconds {
    std::array<double, 6> stage = {};  // in the order of the stages
    double frame = 0;                  // less than their sum: the paper overlaps stages
  };
  std::optional<Milliseconds> paper;
  // Of `frame` or of a stage by its name; nothing where the paper has nothing.
  std::optional<double> paper_ms(const std::string& what) const;
  bool sampled_only = false;  // the figure is about clusters that leave edges uncovered
};
// cuboid, liver, kidney, irregular. find: null if there is none of that name.
const std::vector<PaperScene>& paper_scenes();
const PaperScene* find_paper_scene(const std::string& name);

// A row of Table 2: a kidney's discontinuous cut. Or the size of Table 3 that Table 2 does not have, without clusters,
// because the paper does not say how many there are.
struct PaperSampling {
  int64_t particles = 0;
  std::optional<int64_t> clusters;
  double frame_ms = 0;
};
// Those of Table 2 first.
const std::vector<PaperSampling>& paper_samplings();

// Fig. 10: how many more clusters there are at the end of a cut than at its start.
inline constexpr double kPaperGrowth = 0.01;

// A scene that is part of the program, which so needs no file, by the name of its file without the ending
// (benchmarks/CMakeLists.txt). Throws std::out_of_range for a scene that is none of those.
Scene embedded_scene(const std::string& file);

// A scene with so many particles. `sampled`: balls that do not cover every edge, with the paper's expansion, which is
// due in every frame that removes something; as many of them as the paper has clusters, unless the scene says how large
// they are. The timed frames are those around the middle of the last stroke. Throws InputError if that stroke and what
// comes after it have fewer frames than are wanted.
BenchScene make_paper_scene(const std::string& file, const std::string& name, int64_t particles, Cooking cooking,
                            int64_t frames);

}  // namespace cutproof::benchmarks
