// Nothing but what a stage may change has changed (method.md §9), field by field, bit by bit (model/fields.h).
#include <fmt/format.h>

#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

template <class T>
void compare(const Field& field, const T& before, const T& after, const State&, Verdict& verdict) {
  ++verdict.checked;
  if (!same_bits(before, after)) violate(verdict, fmt::format("{} changed", field.text));
}

// `names`: the state whose clusters' numbers name them.
template <class T>
void compare(const Field& field, const std::vector<T>& before, const std::vector<T>& after, const State& names,
             Verdict& verdict) {
  verdict.checked += static_cast<int64_t>(before.size());
  if (same_bits(before, after)) return;
  if (before.size() != after.size()) {
    violate(verdict, fmt::format("{} changed: {} entries before, {} after", field.text, before.size(), after.size()));
    return;
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (same_bits(before[i], after[i])) continue;
    Witness witness;
    auto name = static_cast<int32_t>(i);
    if (field.space == IndexSpace::particle) witness.particles = {name};
    if (field.space == IndexSpace::cluster) witness.clusters = {name = names.clusters.number[i]};
    witness.text = fmt::format("{} changed, first at {}", field.text, name);
    violate(verdict, witness);
  }
}

// A step moves what is alive, and starts the frame's lists anew.
void check_conditions_of_step(const StageRun& run, Verdict& verdict) {
  const State &before = run.before, &after = run.after;
  for (std::size_t i = 0; i < before.alive.size(); ++i) {
    if (before.alive[i] != 0) continue;
    ++verdict.checked;
    if (same_bits(before.x[i], after.x[i])) continue;
    violate(verdict, fmt::format("particle {} is dead, but moved", i), {}, {static_cast<int32_t>(i)});
  }
  if (after.removed.empty() && after.debris.empty()) return;
  violate(verdict, "a step starts a frame, but particles are listed as removed in it", {},
          after.removed.empty() ? after.debris : after.removed);
}

// The end of the frame, or the stage alone: then the frame stays, and nothing is compacted.
void check_conditions_of_skin(const StageRun& run, Verdict& verdict) {
  const int64_t before = run.before.frame, after = run.after.frame;
  const std::vector<int32_t>&numbers = run.after.clusters.number, &numbers_before = run.before.clusters.number;
  const bool ended = after - 1 == before;
  ++verdict.checked;
  if (!ended && before != after) {
    violate(verdict, fmt::format("the frame changed by other than one: {} before, {} after", before, after));
  }
  if (numbers_before.size() != numbers.size()) {
    violate(verdict, fmt::format("{} clusters before, {} after", numbers_before.size(), numbers.size()));
    return;
  }
  for (std::size_t c = 0; c < numbers.size(); ++c) {
    ++verdict.checked;
    const bool compact = numbers[c] == static_cast<int32_t>(c);
    if (compact || (!ended && numbers[c] == numbers_before[c])) continue;
    violate(verdict, fmt::format("cluster {} should have the number {} at the end of the frame", numbers[c], c),
            {numbers[c]});
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
