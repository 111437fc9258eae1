// The list of all properties: name, source, input, condition and check. Judges walk such a list and name no property.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "model/fields.h"
#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"

namespace cutproof::oracles {

class Judged;  // oracles/judged.h: a well-formed state and derived data

// Whether the rotation that a step has left to a cluster is in the state after it. If the state after the step was made
// from a later one with other clusters, no cluster may be known to have kept this rotation, or none may come from this
// cluster; then the rotation is not shown.
enum class RotationKnown : uint8_t { no, yes, gone };

// A stage that was run: the states before and after it, both well formed.
struct StageRun {
  const Setup& setup;
  Stage stage;
  const State& before;
  const State& after;
  // [clusters] Of a step, and of the detection after it. Empty: all are known.
  std::span<const RotationKnown> known_rotations = {};
};

// Cost of a check, compared with a frame of the reference: less, or more.
enum class Cost { cheap, thorough };

// When a property of a state applies: in words, and whether a state in which `after` was the last stage must have it.
// Tasks of later stages are not required. Must be safe on states that are not well formed.
struct Due {
  std::string_view text = {};
  bool (*holds)(const Setup& setup, const State& state, Stage after) = nullptr;
};

// A property is one of a state (`check_state`) or one of a stage (`check_stage`): exactly one of the two is there. A
// check fills holds, measured, bound, checked and witness of a verdict that holds so far, and may say in `vacuous` why
// there was nothing to check. It must not throw on any well-formed state, however wrong.
struct Property {
  std::string_view name;    // as verdicts name it, unique among all lists
  std::string_view source;  // section of the docs that demands it or derives its bound
  std::string_view unit;    // of the measured value
  unsigned rests_on;        // parts of the state, and of nothing else but the setup (model/fields.h, Part)
  Cost cost;
  StageSet promised_by;      // stages whose answer the property judges
  Due due;                   // of a property of a state
  std::string_view nothing;  // why nothing was checked, where nothing was
  void (*check_state)(Judged& judged, Verdict& verdict);
  void (*check_stage)(const StageRun& run, Verdict& verdict);
};

using PropertyList = std::vector<Property>;
using PropertyLists = std::vector<const PropertyList*>;

// All that needs neither CGAL nor SuiteSparse. The first is "well formed": no other is asked of a state without it.
// Those that need CGAL stand in oracles/surface/surface.h.
const PropertyList& core_properties();

// The motion, computed again: costs a step of the reference, or a few steps where much is inconclusive.
const PropertyList& motion_properties();

// Properties of a single state without its run. The list of removed particles then names all particles ever removed,
// not those of one frame. Rotations are compared with positions; in a run they follow from the step. The judge of such
// a state adds this list.
const PropertyList& lone_state_properties();

// Throws std::out_of_range if the list has no property of this name.
const Property& property_named(const PropertyList& list, std::string_view name);

// The verdict of one property, whether or not it is due. `frame` is that of the (later) state; stage, backend and body
// are the caller's to fill. None throws on a broken state, however broken.
Verdict ask(const Property& property, const Setup& setup, const State& state);
Verdict ask(const Property& property, const Setup& setup, Stage stage, const State& before, const State& after);

// The same for states that are known to be well formed, and for stages with the verdicts "well formed" of both states.
Verdict ask(const Property& property, Judged& judged);
Verdict ask(const Property& property, const StageRun& run, const Verdict& form_before, const Verdict& form_after);

}  // namespace cutproof::oracles
