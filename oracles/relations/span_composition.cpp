// A frame equals the composition of its spans (architecture.md, Backends).
#include <fmt/format.h>

#include <algorithm>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {
namespace {

Verdict compose_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  Verdict verdict = begin("span composition", backend, state, "1", "architecture.md, Backends: bit for bit");
  if (auto unjudged = unable(verdict, backend, kFrame)) return *unjudged;
  std::vector<std::vector<Span>> ways(1);
  for (const Stage stage : kStages) ways[0].push_back({stage, stage});
  for (std::size_t cut = 1; cut < kStages.size(); ++cut) {
    ways.push_back({{Stage::step, kStages[cut - 1]}, {kStages[cut], Stage::skin}});
  }
  std::erase_if(ways, [&](const std::vector<Span>& way) {
    return !std::all_of(way.begin(), way.end(), [&](Span span) { return backend.can_run(span); });
  });
  if (ways.empty()) return vacuous(verdict, "the backend runs whole frames only");
  std::vector<State> whole;
  backend.load({setup}, {state});
  for (int64_t f = 0; f < frames; ++f) {
    backend.run(kFrame);
    whole.push_back(backend.snapshot().at(0));
  }
  for (const auto& way : ways) {
    backend.load({setup}, {state});
    for (const State& expected : whole) {
      for (const Span span : way) backend.run(span);
      ++verdict.checked;
      const auto found = bit_difference(expected, backend.snapshot().at(0));
      if (!found) continue;
      std::string text = "the frame in spans";
      for (const Span span : way) text += fmt::format(" {}-{}", name_of(span.first), name_of(span.last));
      return fail_on(std::move(verdict), text, *found);
    }
  }
  return verdict;
}

}  // namespace

Verdict span_composition(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  return conclude(compose_frames(backend, setup, state, frames), "no frame was run");
}

}  // namespace cutproof::oracles
