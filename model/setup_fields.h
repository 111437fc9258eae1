// The list of all fields of a Setup. Code that records, checks, compares or writes setups walks this list and names no
// field. model/fields.h does the same for a State.
#pragma once
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/rules.h"
#include "model/setup.h"

namespace cutproof {

// The entities that a field has entries for.
enum class SetupSpace {
  one,            // one value
  node,           // [nodes of the grid]
  particle,       // [n]
  grid_particle,  // [n] on a grid, else empty
  bare_particle,  // [n] of a bare graph, else empty
  frame,          // [frames]
  substep,        // [frames · S]
  stroke,         // [strokes]
  wall,           // [walls]
  grip,           // [grips]
  free            // [a length of its own]
};

inline constexpr double kAnyNumber = -std::numeric_limits<double>::infinity();

struct SetupField {
  std::string_view group;  // "step"; of an entry of a list: that of the list
  std::string_view name;   // within the group: "solver"
  SetupSpace space;
  std::string_view unit = "1";  // "1" for counts, flags, names and ratios
  // Bounds of a number, of each component of a vector, or of each entry of a list. All numbers are finite.
  double least = kAnyNumber;
  bool above = false;  // `least` itself is not allowed
};

namespace fields_detail {
// These do not compile when a member is added or taken away: then the lists below are to be changed as well.
inline void know_every_member(const Setup& setup) {
  [[maybe_unused]] const auto& [body, step, detect, split, merge, expand, skin, walls, grips, has_blade, blade,
                                substep_length, blade_moves, stroke_end, withheld_iterations] = setup;
  [[maybe_unused]] const auto& [name, grid, node, particle_at, rest, edge_offsets, edge_ends, mass, surface_crossing,
                                origin, orientation] = body;
  [[maybe_unused]] const auto& [nodes, spacing] = grid;
  [[maybe_unused]] const auto& [solver, substeps, iterations, stiffness, volume_share, relaxation, acceleration,
                                damping, retardation, gravity] = step;
  [[maybe_unused]] const auto& [criterion, remove, epsilon, strain, without_blade] = detect;
  [[maybe_unused]] const auto& [debris] = split;
  [[maybe_unused]] const auto& [merge_rule] = merge;
  [[maybe_unused]] const auto& [expand_rule, expand_depth] = expand;
  [[maybe_unused]] const auto& [wanted, alpha, fit_cuts] = skin;
  [[maybe_unused]] const auto& [length, blade_depth, thickness, friction] = blade;
}
inline void know_every_member(const Wall& wall) { [[maybe_unused]] const auto& [axis, side, offset, friction] = wall; }
inline void know_every_member(const Grip& grip) {
  [[maybe_unused]] const auto& [particles, active, displacement] = grip;
}
inline void know_every_member(const BladeMove& move) {
  [[maybe_unused]] const auto& [from, to, down, stroke] = move;
  [[maybe_unused]] const auto& [edge, along, back] = from;
}
}  // namespace fields_detail

#define CUTPROOF_FIELD(member, ...) \
  visit(                            \
      SetupField{__VA_ARGS__}, [](auto& s) -> auto& { return s.member; })

// visit(field, get) for each field, in a fixed order. get(setup) is a reference to the field of a Setup or const Setup.
// Fields of type vector<Wall>, vector<Grip> and vector<BladeMove> are lists of structs, whose own fields follow below.
template <class Visit>
constexpr void for_each_setup_field(Visit&& visit) {
  using enum SetupSpace;
  CUTPROOF_FIELD(body.name, "body", "name", one);
  CUTPROOF_FIELD(body.grid.nodes, "body", "nodes", one, "1", 0);
  CUTPROOF_FIELD(body.grid.spacing, "body", "spacing", one, "m", 0, true);
  CUTPROOF_FIELD(body.origin, "body", "origin", one, "m");
  CUTPROOF_FIELD(body.orientation, "body", "orientation", one);
  CUTPROOF_FIELD(body.node, "body", "node", grid_particle, "1", 0);
  CUTPROOF_FIELD(body.particle_at, "body", "particle_at", node, "1", -1);
  CUTPROOF_FIELD(body.rest, "body", "rest", bare_particle, "m");
  CUTPROOF_FIELD(body.edge_offsets, "body", "edge_offsets", free, "1", 0);
  CUTPROOF_FIELD(body.edge_ends, "body", "edge_ends", free, "1", 0);
  CUTPROOF_FIELD(body.mass, "body", "mass", particle, "kg", 0, true);
  CUTPROOF_FIELD(body.surface_crossing, "body", "surface_crossing", free, "h/256", 0);
  CUTPROOF_FIELD(step.solver, "step", "solver", one);
  CUTPROOF_FIELD(step.substeps, "step", "substeps", one, "1", 1);
  CUTPROOF_FIELD(step.iterations, "step", "iterations", one, "1", 0);
  CUTPROOF_FIELD(step.stiffness, "step", "stiffness", one, "1/s²");
  CUTPROOF_FIELD(step.volume_share, "step", "volume_share", one, "1", 0);
  CUTPROOF_FIELD(step.relaxation, "step", "relaxation", one);
  CUTPROOF_FIELD(step.acceleration, "step", "acceleration", one);
  CUTPROOF_FIELD(step.damping, "step", "damping", one, "1/s");
  CUTPROOF_FIELD(step.retardation, "step", "retardation", one, "s", 0);
  CUTPROOF_FIELD(step.gravity, "step", "gravity", one, "m/s²");
  CUTPROOF_FIELD(detect.criterion, "detect", "criterion", one);
  CUTPROOF_FIELD(detect.remove, "detect", "remove", one);
  CUTPROOF_FIELD(detect.epsilon, "detect", "epsilon", one, "h");
  CUTPROOF_FIELD(detect.strain, "detect", "strain", one);
  CUTPROOF_FIELD(detect.without_blade, "detect", "without_blade", one);
  CUTPROOF_FIELD(split.debris, "split", "debris", one, "particles", 0);
  CUTPROOF_FIELD(merge.rule, "merge", "rule", one);
  CUTPROOF_FIELD(expand.rule, "expand", "rule", one);
  CUTPROOF_FIELD(expand.depth, "expand", "depth", one, "layers", 1);
  CUTPROOF_FIELD(skin.wanted, "skin", "wanted", one);
  CUTPROOF_FIELD(skin.alpha, "skin", "alpha", one, "h");
  CUTPROOF_FIELD(skin.fit_cuts, "skin", "fit_cuts", one);
  CUTPROOF_FIELD(walls, "walls", "", wall);
  CUTPROOF_FIELD(grips, "grips", "", grip);
  CUTPROOF_FIELD(has_blade, "blade", "present", one);
  CUTPROOF_FIELD(blade.length, "blade", "length", one, "m", 0);
  CUTPROOF_FIELD(blade.depth, "blade", "depth", one, "m", 0);
  CUTPROOF_FIELD(blade.thickness, "blade", "thickness", one, "m", 0);
  CUTPROOF_FIELD(blade.friction, "blade", "friction", one, "1", 0);
  CUTPROOF_FIELD(blade_moves, "blade_moves", "", substep);
  CUTPROOF_FIELD(substep_length, "", "substep_length", frame, "s", 0, true);
  CUTPROOF_FIELD(stroke_end, "", "stroke_end", stroke, "1", -1);
}

// visit(field, get) for each field of one entry of a list; get(entry) is a reference to it.
template <class Entry, class Visit>
constexpr void for_each_entry_field(Visit&& visit) {
  using enum SetupSpace;
  if constexpr (std::is_same_v<Entry, Wall>) {
    CUTPROOF_FIELD(axis, "walls", "axis", one, "1", 0);
    CUTPROOF_FIELD(side, "walls", "side", one, "1", -1);
    CUTPROOF_FIELD(offset, "walls", "offset", one, "m");
    CUTPROOF_FIELD(friction, "walls", "friction", one, "1", 0);
  } else if constexpr (std::is_same_v<Entry, Grip>) {
    CUTPROOF_FIELD(particles, "grips", "particles", free, "1", 0);
    CUTPROOF_FIELD(active, "grips", "active", substep, "1", 0);
    CUTPROOF_FIELD(displacement, "grips", "displacement", substep, "m");
  } else {
    static_assert(std::is_same_v<Entry, BladeMove>);
    CUTPROOF_FIELD(from.edge, "blade_moves", "from_edge", one, "m");
    CUTPROOF_FIELD(from.along, "blade_moves", "from_along", one);
    CUTPROOF_FIELD(from.back, "blade_moves", "from_back", one);
    CUTPROOF_FIELD(to.edge, "blade_moves", "to_edge", one, "m");
    CUTPROOF_FIELD(to.along, "blade_moves", "to_along", one);
    CUTPROOF_FIELD(to.back, "blade_moves", "to_back", one);
    CUTPROOF_FIELD(down, "blade_moves", "down", one);
    CUTPROOF_FIELD(stroke, "blade_moves", "stroke", one, "1", -1);
  }
}

#undef CUTPROOF_FIELD

// Whether T is a list of structs that have fields of their own.
template <class T>
inline constexpr bool is_list_of_entries =
    std::is_same_v<T, std::vector<Wall>> || std::is_same_v<T, std::vector<Grip>> ||
    std::is_same_v<T, std::vector<BladeMove>>;

}  // namespace cutproof
