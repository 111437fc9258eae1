// Pieces of `cutproof bench factors`: what a cut does to the linear system of a substep
// (oracles/comparison/cluster_system.h), and the ways of having a factor of the changed system.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/comparison/cluster_system.h"

namespace cutproof::cli {

// --- A body that is cut ----------------------------------------------------------------------------------------------

// A cube at rest that a geometric cut goes through, a spacing a frame, a third of a spacing off a layer of nodes.
struct CutCube {
  std::string name;
  Setup setup;
  State state;  // before frame 0
};
// side³ particles, `boxes` clusters with cores of core³.
CutCube make_cut_cube(int32_t side, int32_t core);

// Three cuts of it: what lies between two states.
struct Cut {
  std::string name;  // "one frame", "quarter", "whole"
  State before, after;
};
std::vector<Cut> cuts_of(const CutCube& cube);

// --- What it does to the system --------------------------------------------------------------------------------------

// In rows of a factor that is kept: those of the clusters before, in their order, then one for each cluster that none
// of these is left for. A row without a cluster has a mass and is not shared.
struct SystemChange {
  oracles::ClusterSystem before, after;
  double s = 0;
  std::vector<int32_t> origin;   // [rows] the row of the cluster that a new row was cut from; else the row itself
  std::vector<int32_t> changed;  // rows of which an entry differs, ascending
  int32_t new_rows = 0;
};
// With every alive particle free and s = k dt² / (1 + k dt²). A cluster keeps its row if its members are the same; of
// the others each takes the row of the cluster that most of its members were in, the largest first.
SystemChange change_of(const Body& body, const State& before, const State& after, double s);

// --- Factors of the changed system -----------------------------------------------------------------------------------

enum class Way {
  analyse,  // as if nothing had been there before
  ordered,  // elimination order kept, a new row after its origin: symbolic and numeric factorisation
  numeric,  // symbolic factorisation kept: only where the changed system has no entry that was not there
  updown,   // rank-one changes: one for each mass that differs and for each set of clusters whose weight differs
  rows,     // each changed row deleted from the factor and added again
};
inline constexpr Way kWays[] = {Way::analyse, Way::ordered, Way::numeric, Way::updown, Way::rows};
const char* name_of(Way way);

struct Factorised {
  double seconds = 0;        // of everything after the changed system is known
  double solve_seconds = 0;  // of one right-hand side
  double residual = 0;       // ‖right − B x‖ / (‖B‖ ‖x‖) in the greatest norm
  int64_t entries = 0;       // of the factor
  std::vector<double> x;     // [rows]
};
// Nothing where the way does not exist. What the earlier factor takes is not in the times; for `updown` and `rows` it
// is in the form and has the order that they need, with the new rows in it.
std::optional<Factorised> factorise(const SystemChange& change, Way way, const std::vector<double>& right);

// By how much the residual may differ from 0 (docs/accuracy_and_speed.md §6).
double residual_bound(const SystemChange& change, Way way);

}  // namespace cutproof::cli
