// Oracles: const state in, verdict out (oracles_and_tests.md §1). None of them knows how a stage was computed; each
// certifies the answer. They depend on model/ only: no line is shared with reference_cpu/ or gpu/.
//
// Every function fills property, holds, measured, bound, unit, bound_source, checked and witness, and the frame from
// the state; the caller adds stage, backend and body. None throws on a broken state, however broken: offsets out of
// range, particles that do not exist and NaN are verdicts.
#pragma once
#include <memory>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"

namespace cutproof::oracles {

// --- One state -----------------------------------------------------------------------------------------------------
// First of all: sizes, offsets monotone, members in range. If this fails, the other oracles of one state answer
// "not judged" (holds = false, witness.text says that the state is not well formed).
Verdict well_formed(const Setup& setup, const State& state);
Verdict cluster_connectivity(const Setup& setup, const State& state);  // I1, by BFS
Verdict coverage(const Setup& setup, const State& state);              // I2; members sorted, unique, alive
// I3 and the skin: components of G = of the coupling "shares a cluster" (both as partitions of the alive particles)
// and, if the state has a skin, = outer shells of the skin (method.md §8). Witness of a failure: two particles and, if
// they are connected, a path.
Verdict component_match(const Setup& setup, const State& state);
// No cluster and no group of clusters isolated inside connected tissue; measured: number of surplus groups, that is
// coupling components minus components of G (0 expected).
Verdict isolation(const Setup& setup, const State& state);
Verdict edge_cover(const Setup& setup, const State& state);    // I4, where state.edge_covered promises it
Verdict rest_frames(const Setup& setup, const State& state);   // T_c and M_c of every cluster
Verdict finite(const Setup& setup, const State& state);        // no NaN, no Inf anywhere
Verdict skin_surface(const Setup& setup, const State& state);  // closed, 2-manifold, oriented; CGAL
// At rest (every X_v from the owner's rest position): no degenerate or self-intersecting triangle, outward, shells =
// components + cavities (18 neighbours), Euler number, volume between bounds; CGAL. Costs about 10 ms on 3,000
// triangles.
Verdict skin_geometry(const Setup& setup, const State& state);
// Each vertex where its owner's clusters put it; owners alive, the other end of the edge empty.
Verdict skin_vertices(const Setup& setup, const State& state);
Verdict rotation_quality(const Setup& setup, const State& state);  // ‖RᵀR − I‖ and det > 0 of every cluster
// No alive edge with two free ends crosses the blade where it stands at the end of the frame just simulated (pass
// the state after detect, before the frame counts up). Dynamic criterion only.
Verdict no_pass(const Setup& setup, const State& state);
// Small clusters that could still merge (method.md §6, maximal): none, given that nothing else is owed.
Verdict merge_maximality(const Setup& setup, const State& state);

// All of the above that apply to a state at the end of a frame; the geometric skin check only if `thorough`.
std::vector<Verdict> judge(const Setup& setup, const State& state, bool thorough);
// The same for a state in the middle of a frame: what later stages still owe after `after` is not asked for, such as
// coverage after detect, or a skin that matches after split. Fills the stage too.
std::vector<Verdict> judge(const Setup& setup, const State& state, Stage after, bool thorough);

// --- One stage: the state before and after it -----------------------------------------------------------------------
Verdict detection(const Setup& setup, const State& before,
                  const State& after);  // removed <=> d_i > εh outside the band
Verdict split_exactness(const Setup& setup, const State& before, const State& after);
Verdict merge_legality(const Setup& setup, const State& before, const State& after);
Verdict expansion(const Setup& setup, const State& before, const State& after);
// Linear momentum over one frame: M v' = decay of M v + gravity + impulse (state.impulse).
Verdict momentum(const Setup& setup, const State& before, const State& after);
// Nothing but what a stage may change has changed (positions by split, clusters by step, …).
Verdict untouched(const Setup& setup, Stage stage, const State& before, const State& after);

// All of the above that apply to a stage, and those of the state after it that are this stage's promise.
std::vector<Verdict> judge_stage(const Setup& setup, Stage stage, const State& before, const State& after);

// --- Many states of one body -----------------------------------------------------------------------------------------
// judge and judge_stage for states that follow one another. A verdict that held is repeated and not computed again as
// long as every part of the state that it rests on keeps its bits; so is what verdicts are derived from, and that a
// cluster is connected as long as its members and their being alive stay the same.
class Judge {
 public:
  // Keeps a reference: the setup must live as long as this and stay as it is.
  explicit Judge(const Setup& setup);
  ~Judge();
  // The last state that was given must stay as it is, and where it is, until another was given.
  std::vector<Verdict> state(const State& state, Stage after, bool thorough);
  std::vector<Verdict> stage(Stage stage, const State& before, const State& after);

  // For reports. Components of G, and shells of the skin whose volume at `position` is not positive, triangles joined
  // at their vertices; 0 if the state is not well formed.
  int32_t component_count(const State& state);
  int32_t inner_shells(const State& state);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

// --- Components, for reports and expectations ------------------------------------------------------------------------
struct Partition {
  std::vector<int32_t> label;  // [n] component of each alive particle, numbered by smallest particle; -1 if dead
  int32_t count = 0;
};
Partition graph_components(const Setup& setup, const State& state);     // BFS on G
Partition coupling_components(const Setup& setup, const State& state);  // "shares a cluster"
// A second, independent count: block triangular form (strongly connected components) by SuiteSparse BTF.
int32_t graph_component_count_btf(const Setup& setup, const State& state);
// A third: n − rank of the Laplacian by SPQR. Slow; for tests.
int32_t graph_component_count_spqr(const Setup& setup, const State& state);
struct ShellCount {
  int32_t outer = 0, inner = 0;
};
ShellCount skin_shells(const Skin& skin);  // CGAL; by sign of the volume at `position`
// Couplings between clusters that are only a shared particle (ball joint) or collinear ones (hinge) (method.md §7).
struct WeakCouplings {
  int64_t ball_joints = 0, hinges = 0;
};
WeakCouplings weak_couplings(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
