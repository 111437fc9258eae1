// A random dissection as plain data: what rapidcheck generates and shrinks, what a counterexample is saved as.
//
// All lengths are integers, in quarters of the grid spacing, so that a case reads well, shrinks towards whole nodes,
// and hits the degenerate positions (a vertex, an edge, a plane of the grid) exactly.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/at.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::property_tests {

using Node = std::array<int32_t, 3>;
using Quarters = std::array<int32_t, 3>;  // a point: 4·i is node i of the case

enum class ClusterKind { boxes, sampled, foreign };
enum class Link { apart, chained, retraced };  // chained: begins where the last stroke ended; retraced: runs it back

struct Stroke {
  Quarters from = {0, 0, 0}, to = {0, 0, 0};  // way of the middle of the cutting edge
  int32_t back = 4;                           // from the edge to the back of the blade, index into kDirections
  bool down = true;                           // false: pen up, the frame passes without a cut
  Link link = Link::apart;
  friend bool operator==(const Stroke&, const Stroke&) = default;
};

struct Case {
  std::vector<Node> nodes;  // tissue, >= 0, ascending, without duplicates
  double spacing = 1;       // h [m]

  ClusterKind clusters = ClusterKind::boxes;
  int32_t side = 5;           // boxes [nodes]
  int32_t seed_spacing = 12;  // sampled [quarters]
  int32_t ball_radius = 16;   // sampled [quarters]
  int32_t most = 8;           // foreign: most particles of a cluster
  int32_t tau = 3, cap = 12;  // foreign
  uint64_t seed = 1;          // sampled and foreign

  MergeRule merge = MergeRule::deterministic;
  ExpandRule expand = ExpandRule::edge_cover;
  int32_t expand_depth = 1;
  int32_t debris = 0;

  int32_t blade_length = 400, blade_depth = 400;  // [quarters], > 0
  int32_t blade_thickness = 4;                    // [quarters], >= 0
  std::vector<Stroke> strokes;                    // in this order; if the body moves, each takes whole frames
  int32_t together = 1;                           // strokes of one frame, where nothing moves; >= 1

  // false: nothing moves, and cuts are geometric. true: the body is soft, and the blade cuts what it stretches apart.
  bool moves = false;
  int32_t substeps = 2, iterations = 2;            // moves: of a frame, of a substep
  int32_t stiffness = 5;                           // moves: log10 of k [1/s²]
  Acceleration acceleration = Acceleration::none;  // moves
  bool ground = false;                             // moves: gravity, and a floor half a spacing below the lowest node

  friend bool operator==(const Case&, const Case&) = default;
};

// A case of a given size, 0 .. kMostSize: from nothing to at most some ten thousand particles, growing slowly (at size
// 100 they are 1,600 on average, at 106 about 2,000); about 30 % of the bodies and of the strokes are degenerate. The
// same case for the same arguments on every platform.
inline constexpr int kMostSize = 110;
Case draw_case(uint64_t seed, int size);
// The same body, clusters and strokes, and it moves.
Case draw_moving_case(uint64_t seed, int size);
// A stroke of the kind that those cases have, for the body of `c`.
Stroke draw_stroke(uint64_t seed, const Case& c);

// Those of a box that are tissue, ascending; asked in the order in which a grid counts them.
std::vector<Node> nodes_where(Node dims, const std::function<bool(Node)>& is_tissue);

// Strokes with links resolved, and what a backend loads. If nothing moves: geometric cuts, one stroke a substep, no
// iteration.
std::vector<Stroke> resolved_strokes(const Case& c);
struct Instance {
  Setup setup;
  State state;
};
Instance instance_of(const Case& c);
// Its setup alone. A stroke that is appended leaves the frames of those before it as they are.
Setup setup_of(const Case& c);

void without_blade(Setup& setup);

// Edits that each make this case simpler (or leave it as it is), the most drastic first: fewer strokes, fewer
// particles, plainer parameters. Repeated as long as one of them keeps a failure, they end: each moves some part
// towards a fixed value.
std::vector<std::function<void(Case&)>> simplifications(const Case& c);

// The simplest case found that still `fails`, by such edits; looks no further once `is_over`. Requires fails(c).
Case simplest(Case c, const std::function<bool(const Case&)>& fails, const std::function<bool()>& is_over);

// One line of JSON. from_json throws std::invalid_argument for anything that is not a case.
std::string to_json(const Case& c);
Case from_json(const std::string& text);

}  // namespace cutproof::property_tests
