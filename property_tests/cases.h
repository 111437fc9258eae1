// A random dissection as plain data: rapidcheck generates and shrinks it, and a counterexample is saved as such.
//
// All lengths are integers, in quarters of the grid spacing, so that a case reads well, shrinks towards whole nodes,
// and hits the degenerate positions (a vertex, an edge, a plane of the grid) exactly. So are all other numbers, in
// tenths, hundredths or powers of ten. Each has a plain value, its default, which most cases have.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::property_tests {

using Node = std::array<int32_t, 3>;
using Quarters = std::array<int32_t, 3>;  // a point: 4·i is node i of the case

enum class ClusterKind { boxes, sampled, foreign, tiles };
enum class Link { apart, chained, retraced };  // chained: begins where the last stroke ended; retraced: runs it back
// Criterion of removal; usual: distance where the body moves, geometric where nothing does.
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
  bool shared = false;                     // also holds particles of earlier grips, at other times
  friend bool operator==(const CaseGrip&, const CaseGrip&) = default;
};

struct Case {
#define LIST(Element, name, most) std::vector<Element> name;
#define FIELD(Type, name, value, simplest) Type name = value;
#include "property_tests/case_fields.inc"
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
// Least and greatest coordinate of nodes along an axis; there is one.
std::pair<int32_t, int32_t> extent(const std::vector<Node>& nodes, std::size_t axis);

// Strokes with links resolved, and what a backend loads. If nothing moves: geometric cuts, one stroke a substep, no
// iteration. Otherwise no substep takes the blade beyond the limits of method.md §3, Blade.
std::vector<Stroke> resolved_strokes(const Case& c);
struct Instance {
  Setup setup;
  State state;
};
Instance instance_of(const Case& c);
// The setup of a case alone. An appended stroke does not change the frames of earlier strokes.
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
