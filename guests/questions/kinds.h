// Shared code of the operations. Internal to guests/questions/.
#pragma once
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "guests/questions/question.h"
#include "model/body.h"
#include "model/setup.h"
#include "model/state.h"
#include "oracles/runs/run.h"

namespace cutproof::guests {

extern const OperationDescription kRotations, kComponents, kSurface, kClusters, kDissect;

// Neighbouring seeds and indices become unlike each other (SplitMix64; Steele, Lea, Flood 2014).
uint64_t mixed(uint64_t seed, int64_t index);

// The same on every machine, which the distributions of <random> are not.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  int32_t below(int32_t end) { return static_cast<int32_t>(engine_() % static_cast<uint64_t>(end)); }
  int32_t between(int32_t least, int32_t most) { return least + below(most - least + 1); }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  bool chance(double p) { return unit() < p; }

 private:
  std::mt19937_64 engine_;
};

// For a question about one body.
int64_t one_body(const Question& question);
std::string size_of_body(const Question& question);

Array rows_of(const Array& array, int64_t first, int64_t end);

// A body of which some particles may be dead.
struct Tissue {
  Body body;                   // on a grid, or a bare graph
  std::vector<uint8_t> alive;  // [n]
};
// Particles at these nodes of a grid, with an empty ring around them; none twice. All alive.
Tissue on_grid(std::vector<std::array<int32_t, 3>> nodes, double spacing);
// A bare graph of n particles at random places. Edges may be named twice.
Tissue bare(int32_t n, const std::vector<std::array<int32_t, 2>>& edges, Random& random);
// The particles for which `keep` holds, and the edges between them.
Tissue part_of(const Tissue& tissue, const std::vector<uint8_t>& keep);

// The arrays of cutproof_tissue, and `alive`.
Arrays arrays_of(const Tissue& tissue);
Tissue tissue_of(const Arrays& arrays);
// Their defect, or "".
std::string problem_of_body(const Question& question);
// The same question with fewer particles, the most drastic first; all of them living, too.
std::vector<Question> fewer_particles(const Question& question);

// Random bodies on a grid of which the hard ones come first; kinds 0 .. kGridKinds - 1.
std::vector<std::string> grid_kinds();
Tissue draw_on_grid(Random& random, int64_t kind);
// Random graphs, likewise; the last kinds are those of grids.
std::vector<std::string> graph_kinds();
Tissue draw_graph(Random& random, int64_t kind);
// Those of n particles each that large questions are about; some of the graphs' are dead.
std::vector<std::string> large_grid_kinds();
Tissue draw_large_on_grid(Random& random, int64_t kind, int32_t n);
std::vector<std::string> large_graph_kinds();
Tissue draw_large_graph(Random& random, int64_t kind, int32_t n);
// Of large questions, which no ordinary one begins with.
uint64_t large_seed(uint64_t seed, int64_t kind);

// Shells of a surface around the living particles of a grid: outer and inner ones.
std::array<int64_t, 2> shells_around(const Tissue& tissue);

}  // namespace cutproof::guests
