// A stage has changed only fields that it may change (method.md §9), field by field, bit by bit (model/fields.h).
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// `names`: the state whose clusters' numbers name them.
template <class T>
void compare(const Field& field, const T& before, const T& after, const State& names, Verdict& verdict) {
  if constexpr (!requires { before.size(); }) {
    ++verdict.checked;
    if (!same_bits(before, after)) violate(verdict, {}, "{} changed", field.text);
  } else {
    verdict.checked += static_cast<int64_t>(before.size());
    if (same_bits(before, after)) return;
    if (before.size() != after.size()) {
      return violate(verdict, {}, "{} changed: {} entries before, {} after", field.text, before.size(), after.size());
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (same_bits(before[i], after[i])) continue;
      Concerned concerned;
      auto name = static_cast<int32_t>(i);
      if (field.space == IndexSpace::particle) concerned.particles = {name};
      if (field.space == IndexSpace::cluster) concerned.clusters = {name = names.clusters.number[i]};
      violate(verdict, concerned, "{} changed, first at {}", field.text, name);
    }
  }
}

// A step moves living particles, and clears the frame's lists. Dead particles keep their last place and velocity.
void check_conditions_of_step(const StageRun& run, Verdict& verdict) {
  const State &before = run.before, &after = run.after;
  for (std::size_t i = 0; i < before.alive.size(); ++i) {
    if (before.alive[i] != 0) continue;
    verdict.checked += 2;
    if (!same_bits(before.x[i], after.x[i])) {
      violate(verdict, {{}, {static_cast<int32_t>(i)}}, "particle {} is dead, but moved", i);
    } else if (!same_bits(before.v[i], after.v[i])) {
      violate(verdict, {{}, {static_cast<int32_t>(i)}}, "particle {} is dead, but its velocity changed", i);
    }
  }
  if (after.removed.empty() && after.debris.empty()) return;
  violate(verdict, {{}, after.removed.empty() ? after.debris : after.removed},
          "a step starts a frame, but particles are listed as removed in it");
}

// The end of the frame, or the stage alone: then the frame stays, and nothing is compacted.
void check_conditions_of_skin(const StageRun& run, Verdict& verdict) {
  const int64_t before = run.before.frame, after = run.after.frame;
  const std::vector<int32_t>&numbers = run.after.clusters.number, &numbers_before = run.before.clusters.number;
  const bool ended = after - 1 == before;
  ++verdict.checked;
  if (!ended && before != after) {
    violate(verdict, {}, "the frame changed by other than one: {} before, {} after", before, after);
  }
  if (numbers_before.size() != numbers.size()) {
    violate(verdict, {}, "{} clusters before, {} after", numbers_before.size(), numbers.size());
    return;
  }
  for (std::size_t c = 0; c < numbers.size(); ++c) {
    ++verdict.checked;
    const bool compact = numbers[c] == static_cast<int32_t>(c);
    if (compact || (!ended && numbers[c] == numbers_before[c])) continue;
    violate(verdict, {{numbers[c]}}, "cluster {} should have the number {} at the end of the frame", numbers[c], c);
  }
}

}  // namespace

void check_untouched(const StageRun& run, Verdict& verdict) {
  for_each_field([&](const Field& field, auto get) {
    if (!field.changed_by.contains(run.stage)) compare(field, get(run.before), get(run.after), run.before, verdict);
  });
  if (run.stage == Stage::step) check_conditions_of_step(run, verdict);
  if (run.stage == Stage::skin) check_conditions_of_skin(run, verdict);
}

}  // namespace cutproof::oracles
