// Oracles: const state in, verdict out (oracles.md). None of them knows how a stage was computed; each
// certifies the answer. They depend on model/ only: no line is shared with reference_cpu/ or gpu/.
//
// Every function fills property, holds, measured, bound, unit, bound_source, checked, vacuous and witness, and the
// frame from the state; the caller adds stage, backend and body. None throws on a broken state, however broken: offsets
// out of range, particles that do not exist and NaN are verdicts. For a state that is not well formed, all functions
// but well_formed answer that the state could not be judged (holds = false; could_be_judged). A verdict whose measured
// value or bound is not finite fails.
//
// Each function is a property of oracles/registry.h; oracles/judge.h checks them all.
#pragma once
#include "oracles/judge.h"
#include "oracles/partitions.h"

namespace cutproof::oracles {

// A property of a state, asked by itself.
struct StateOracle {
  const PropertyList& (*list)();
  std::string_view name;
  Verdict operator()(const Setup& setup, const State& state) const {
    return ask(property_named(list(), name), setup, state);
  }
  friend bool operator==(const StateOracle&, const StateOracle&) = default;
};
// A property of a stage.
struct StageOracle {
  std::string_view name;
  Stage stage;
  const PropertyList& (*list)() = core_properties;
  Verdict operator()(const Setup& setup, const State& before, const State& after) const {
    return ask(property_named(list(), name), setup, stage, before, after);
  }
};

// --- One state -----------------------------------------------------------------------------------------------------
// First of all: sizes, offsets monotone, members in range.
inline constexpr StateOracle well_formed{core_properties, "well formed"};
inline constexpr StateOracle finite{core_properties, "finite"};                              // no NaN, no Inf anywhere
inline constexpr StateOracle cluster_connectivity{core_properties, "cluster connectivity"};  // I1, by BFS
inline constexpr StateOracle coverage{core_properties, "coverage"};  // I2; members sorted, unique, alive
// I3: components of G = of the coupling "shares a cluster", both as partitions of the alive particles. Witness of a
// failure: two particles, and a path if they are connected and not coupled, else the cluster that couples them.
inline constexpr StateOracle component_match{core_properties, "component match"};
// If the state has a skin, components of G = its outer shells, and cavities = its inner ones (method.md §8).
inline constexpr StateOracle skin_match{core_properties, "skin match"};
// No cluster and no group of clusters isolated inside connected tissue; measured: number of surplus groups, that is
// coupling components minus components of G (0 expected).
inline constexpr StateOracle isolation{core_properties, "isolation"};
inline constexpr StateOracle edge_cover{core_properties, "edge cover"};    // I4, where state.edge_covered promises it
inline constexpr StateOracle rest_frames{core_properties, "rest frames"};  // T_c and M_c of every cluster
inline constexpr StateOracle rotation_quality{core_properties, "rotation"};  // ‖RᵀR − I‖ and det > 0 of every cluster
// The rotation of each cluster is within half a right angle of the best one for its particles' positions; or is the
// best one. For a state without its run (`lone_state_properties`).
inline constexpr StateOracle rotation_fits{lone_state_properties, "rotation match"};
inline constexpr StateOracle rotation_is_best{lone_state_properties, "best rotation"};
// Small clusters that could still merge (method.md §6, maximal): none, given that nothing else is owed.
inline constexpr StateOracle merge_maximality{core_properties, "merge maximality"};
// No alive edge with two free ends crosses the blade where it stands at the end of the frame just simulated (pass
// the state after detect, before the frame counts up). Dynamic criterion only.
inline constexpr StateOracle no_pass{core_properties, "no pass"};
inline constexpr StateOracle skin_surface{core_properties,
                                          "skin surface"};  // closed, 2-manifold, oriented, by half-edges
// The same of a surface whose vertices have no owners: `skin` has positions and triangles alone, and may be wrong in
// any way.
Verdict closed_surface(const Skin& skin);
// Each vertex where its owner's clusters put it; owners alive, the other end of the edge empty.
inline constexpr StateOracle skin_vertices{core_properties, "skin vertices"};

// --- One stage: the state before and after it -----------------------------------------------------------------------
// Linear momentum over one frame: M v' = decay of M v + gravity + impulse (state.impulse).
inline constexpr StageOracle momentum{"linear momentum", Stage::step};
// The same of each component of G, along each axis on which nothing has pushed: no force joins separated pieces.
inline constexpr StageOracle component_momentum{"component momentum", Stage::step};
// Positions and velocities before and after the step of one frame belong together. What can be said of it without
// running the step again:
// - one substep a frame: each particle has moved by dt v' / D, with D = e^(−c dt);
// - a particle that a grip holds throughout has followed the grip's path, and one that it holds in the last substep has
//   the path's velocity;
// - along each axis in which no contact can push, the centre of mass has moved as momentum and gravity say; along one
//   in which contacts push to one side only, by what the frame's impulse can add at its latest and at its earliest.
// `measured` and `bound` are those of the comparison that comes nearest to its bound or goes farthest beyond [h].
// Vacuous where none of these can be asked: a blade that is down, friction or a grip may push to any side.
inline constexpr StageOracle motion{"motion", Stage::step};
// The step, computed again from the state before it, by an oracle that shares no line with any backend: where every
// particle, velocity, rotation and the impulse may be, given the rounding of the state's precision. Where a decision is
// inconclusive, all coupled quantities have wider bounds. `measured` and `bound` as above; `inconclusive` counts what
// no sharp bound was asked of.
inline constexpr StageOracle admissible_step{"admissible step", Stage::step, motion_properties};
inline constexpr StageOracle detection{"detection",
                                       Stage::detect};  // removed <=> as the criterion says, outside the band
inline constexpr StageOracle split_exactness{"split exactness", Stage::split};
inline constexpr StageOracle merge_legality{"merge legality", Stage::merge};
// No union has more than `cap` particles, where the rule promises that.
inline constexpr StageOracle cap_kept{"cap kept", Stage::merge};
inline constexpr StageOracle expansion{"expansion", Stage::expand};
// Where vertices lie on their grid edges: those that were there before stay, those that a blade has brought about lie
// where its plane crosses the edge, within what rounding leaves open. `measured` and `bound` [h].
inline constexpr StageOracle skin_reach{"skin reach", Stage::skin};
// A stage has changed only the fields that it may change (no positions by split, no clusters by step, …).
inline Verdict untouched(const Setup& setup, Stage stage, const State& before, const State& after) {
  return StageOracle{"untouched", stage}(setup, before, after);
}

}  // namespace cutproof::oracles
