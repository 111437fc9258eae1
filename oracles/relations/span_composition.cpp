// A frame equals the composition of its spans (architecture.md, Backends).
#include <fmt/format.h>

#include <algorithm>

#include "oracles/relations/relations.h"
#include "oracles/relations/shared.h"

namespace cutproof::oracles {

Verdict span_composition(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  const Relation relation = {"span composition", "1", "architecture.md, Backends: bit for bit", "no frame was run"};
  return judge_relation(relation, backend, kFrame, setup, state, [&](Verdict& verdict) {
    std::vector<std::vector<Span>> ways(1);
    for (const Stage stage : kStages) ways[0].push_back({stage, stage});
    for (std::size_t cut = 1; cut < kStages.size(); ++cut) {
      ways.push_back({{Stage::step, kStages[cut - 1]}, {kStages[cut], Stage::skin}});
    }
    std::erase_if(ways, [&](const std::vector<Span>& way) {
      return !std::all_of(way.begin(), way.end(), [&](Span span) { return backend.can_run(span); });
    });
    if (ways.empty()) return vacuous(verdict, "the backend runs whole frames only");
    const std::vector<State> whole = after_each(backend, setup, state, std::vector<Span>(at(frames), kFrame));
    for (const auto& way : ways) {
      std::string text = "the frame in spans";
      for (const Span span : way) text += fmt::format(" {}-{}", name_of(span.first), name_of(span.last));
      backend.load({setup}, {state});
      for (const State& expected : whole) {
        for (const Span span : way) backend.run(span);
        ++verdict.checked;
        if (!require_same_bits(verdict, text, expected, backend.snapshot().at(0))) return;
      }
    }
  });
}

}  // namespace cutproof::oracles
