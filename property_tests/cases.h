// A random dissection as plain data: what rapidcheck generates and shrinks, what a counterexample is saved as.
//
// All lengths are integers, in quarters of the grid spacing, so that a case reads well, shrinks towards whole nodes,
// and hits the degenerate positions (a vertex, an edge, a plane of the grid) exactly. So are all other numbers, in
// tenths, hundredths or powers of ten. Each has a plain value, its default, which most cases have.
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
// What takes particles out; usual: distance where the body moves, geometric where nothing does.
enum class Removal { usual, geometric, strain };

struct Stroke {
  Quarters from = {0, 0, 0}, to = {0, 0, 0};  // way of the middle of the cutting edge
  int32_t back = 4;                           // from the edge to the back of the blade, index into kDirections
  bool down = true;                           // false: pen up, the frame passes without a cut
  Link link = Link::apart;
  Quarters tilt = {0, 0, 0};   // added to four times the direction of `back`; each within -3 .. 3
  Quarters along = {0, 0, 0};  // direction of the cutting edge, as far as orthogonal to the back; 0: that of the way
  Quarters turn = {0, 0, 0};   // axis times angle over the whole way [1/100]; halfway the blade stands as said above
  friend bool operator==(const Stroke&, const Stroke&) = default;
};

// A half-space that tissue may not enter.
struct CaseWall {
  int32_t axis = 2, side = +1;  // tissue keeps to this side
  int32_t offset = 0;           // [quarters]
  int32_t friction = 0;         // [tenths]
  friend bool operator==(const CaseWall&, const CaseWall&) = default;
};

// Holds the particles of a box of nodes that no earlier grip of the case holds.
struct CaseGrip {
  Node low = {0, 0, 0}, high = {0, 0, 0};  // both included
  Quarters pull = {0, 0, 0};               // in each substep [h/100]; 0: pinned
  int32_t from = 0, until = -1;            // substeps of the run; -1: never released
  bool shared = false;                     // also holds what earlier ones hold at other times
  friend bool operator==(const CaseGrip&, const CaseGrip&) = default;
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

  int32_t alpha = 5;    // where skin vertices sit on their grid edge [tenths]
  int32_t surface = 0;  // whose random numbers say where the surface crosses grid edges; 0: not known

  // false: nothing moves, and cuts are geometric. true: the body is soft, and the blade cuts what it stretches apart.
  bool moves = false;
  int32_t substeps = 2, iterations = 2;            // moves: of a frame, of a substep
  int32_t stiffness = 5;                           // moves: log10 of k [1/s²]
  Acceleration acceleration = Acceleration::none;  // moves
  bool ground = false;                             // moves: gravity, and a floor half a spacing below the lowest node

  // All of these only where the body moves.
  Removal removal = Removal::usual;
  RemovedEnds remove = RemovedEnds::both;      // usual removal
  int32_t epsilon = 15;                        // [tenths]
  int32_t strain = 120;                        // removal by strain: the greatest stretch that is no cut [hundredths]
  Solver solver = Solver::implicit;            // published: without acceleration
  int32_t relaxation = 5;                      // published [tenths]
  int32_t damping = 0;                         // [1/s]
  int32_t retardation = 0;                     // implicit [tenths of dt]
  int32_t time_step = 1000;                    // dt [µs]
  int32_t pace = 1;                            // so many times the frames that the blade needs
  int32_t blade_friction = 0;                  // [tenths]
  std::array<int32_t, 3> gravity = {0, 0, 0};  // besides that of `ground` [h/1000 per dt²]
  std::vector<CaseWall> walls;                 // besides the floor
  std::vector<CaseGrip> grips;

  friend bool operator==(const Case&, const Case&) = default;
};

// A case of a given size, 0 .. kMostSize: from nothing to at most some ten thousand particles, growing slowly (at size
// 100 they are 1,600 on average, at 106 about 2,000); about 30 % of the bodies and of the strokes are degenerate. The
// same case for the same arguments on every platform.
inline constexpr int kMostSize = 110;
Case draw_case(uint64_t seed, int size);
// The same body and clusters, and it moves. In more than half of these cases short blades press on the tissue with
// their faces, sides, edges and backs instead of running through it: there contacts are that rounding or a wrong branch
// decides.
Case draw_moving_case(uint64_t seed, int size);
// A stroke of the kind that those cases have, for the body of `c`.
Stroke draw_stroke(uint64_t seed, const Case& c);

// Those of a box that are tissue, ascending; asked in the order in which a grid counts them.
std::vector<Node> nodes_where(Node dims, const std::function<bool(Node)>& is_tissue);

// Strokes with links resolved, and what a backend loads. If nothing moves: geometric cuts, one stroke a substep, no
// iteration. Otherwise no substep takes the blade beyond the limits of method.md §3, Blade.
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

// One line of JSON. from_json throws std::invalid_argument for anything that is not a case, of which every field is
// given.
std::string to_json(const Case& c);
Case from_json(const std::string& text);

}  // namespace cutproof::property_tests
