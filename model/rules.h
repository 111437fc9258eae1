// All choices that a scene makes by name: the name in files, and the promises of the answer.
#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "model/setup.h"
#include "model/stage.h"

namespace cutproof {

// Names in files, in the order of the enumerators.
inline constexpr std::array<std::string_view, 2> kSolverNames = {"implicit", "published"};
inline constexpr std::array<std::string_view, 2> kAccelerationNames = {"none", "chebyshev"};
inline constexpr std::array<std::string_view, 4> kCriterionNames = {"none", "distance", "geometric", "strain"};
inline constexpr std::array<std::string_view, 3> kRemovedEndsNames = {"both", "one", "nearer"};
inline constexpr std::array<std::string_view, 3> kMergeRuleNames = {"none", "deterministic", "published"};
inline constexpr std::array<std::string_view, 3> kExpandRuleNames = {"none", "edge_cover", "published"};

constexpr std::span<const std::string_view> names_of(Solver) { return kSolverNames; }
constexpr std::span<const std::string_view> names_of(Acceleration) { return kAccelerationNames; }
constexpr std::span<const std::string_view> names_of(Criterion) { return kCriterionNames; }
constexpr std::span<const std::string_view> names_of(RemovedEnds) { return kRemovedEndsNames; }
constexpr std::span<const std::string_view> names_of(MergeRule) { return kMergeRuleNames; }
constexpr std::span<const std::string_view> names_of(ExpandRule) { return kExpandRuleNames; }

// Choices of which the names are listed above.
template <class E>
concept NamedChoice = std::is_enum_v<E> && requires(E choice) {
  names_of(choice);
};

template <NamedChoice E>
constexpr std::string_view name_of(E choice) {
  return names_of(choice)[static_cast<std::size_t>(choice)];
}
// The choice of this name, if there is one.
template <NamedChoice E>
constexpr std::optional<E> choice_named(std::string_view name) {
  const auto names = names_of(E{});
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<E>(found - names.begin());
}

// Promises of a rule of merging (method.md §6).
struct MergePromise {
  bool unique;   // a function of the input alone: two right backends give the same clusters
  bool maximal;  // no small cluster is left that could still merge
};
constexpr MergePromise promise_of(MergeRule rule) {
  using enum MergeRule;
  return {.unique = rule == none || rule == deterministic, .maximal = rule != none};
}

// Promises of a rule of expansion (method.md §7).
struct ExpandPromise {
  bool covers_edges;  // I4 holds afterwards, so no tissue is uncoupled
  bool runs_always;   // in every frame that cuts; else only until I4 is known to hold
};
constexpr ExpandPromise promise_of(ExpandRule rule) {
  return {.covers_edges = rule == ExpandRule::edge_cover, .runs_always = rule == ExpandRule::published};
}

// Promises of a criterion (method.md §4).
struct CriterionPromise {
  bool keeps_blade_out;  // no tissue stands across the blade
};
constexpr CriterionPromise promise_of(Criterion criterion) {
  return {.keeps_blade_out = criterion == Criterion::distance};
}

// Promises of a rule of removed ends (method.md §4).
struct RemovePromise {
  bool order_independent;  // with particles in another order the answer is the same
};
constexpr RemovePromise promise_of(RemovedEnds remove) { return {.order_independent = remove == RemovedEnds::both}; }

// Whether a body in this state is due a stage (model/backend.h, run), given the state before the stage.
// A backend writes its own rule of this: it is tested against this one.
inline bool is_due(const Setup& setup, Stage stage, bool something_removed, bool edge_covered) {
  switch (stage) {
    case Stage::step:
      return true;
    case Stage::detect:
      return needs_detection(setup);
    case Stage::split:
      return something_removed;
    case Stage::merge:
      return something_removed && setup.merge.rule != MergeRule::none;
    case Stage::expand:
      return something_removed && (promise_of(setup.expand.rule).runs_always ||
                                   (promise_of(setup.expand.rule).covers_edges && !edge_covered));
    case Stage::skin:
      return setup.skin.wanted;
  }
  return false;
}

}  // namespace cutproof
