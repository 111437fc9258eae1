// What can be judged: every property once, with its name, where it comes from, what it rests on, when it applies, and
// the check. Who judges walks such a list and names no property by itself.
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

class Judged;  // oracles/judged.h: a well-formed state and what follows from it

// Whether the rotation that a step has left to a cluster is in the state after it. Where that was made from a later
// one, in which clusters have changed, none of those may be known to have kept it; or none may come from it at all, and
// then nobody is shown it.
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

// What a check costs beside a frame of the reference: less, or more.
enum class Cost { cheap, thorough };

// When a property of a state applies: in words, and whether a state in which `after` was the last stage must have it.
// What later stages still owe is not asked for. Must be safe on states that are not well formed.
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
  std::string_view unit;    // of what is measured
  unsigned rests_on;        // parts of the state, and of nothing else but the setup (model/fields.h, Part)
  Cost cost;
  StageSet promised_by;      // stages whose answer it belongs to: asked when such a stage is judged
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

// The motion, computed again: what a step of the reference costs, and a few times that where rounding decides much.
const PropertyList& motion_properties();

// Of a state that comes by itself, without the run that led to it: its list of removed particles names every one that
// was ever taken out, where a state of a run names those of its frame; and its rotations are held against its
// positions, where those of a run follow from the step. Who judges such a state adds this list.
const PropertyList& lone_state_properties();

// Throws std::out_of_range if the list has no property of this name.
const Property& property_named(const PropertyList& list, std::string_view name);

// The verdict of one property, whether or not it is due. `frame` is that of the (later) state; stage, backend and body
// are the caller's to fill. None throws on a broken state, however broken.
Verdict ask(const Property& property, const Setup& setup, const State& state);
Verdict ask(const Property& property, const Setup& setup, Stage stage, const State& before, const State& after);

// The same of states that are known to be well formed, and of stages given what "well formed" said of both states.
Verdict ask(const Property& property, Judged& judged);
Verdict ask(const Property& property, const StageRun& run, const Verdict& form_before, const Verdict& form_after);

}  // namespace cutproof::oracles
