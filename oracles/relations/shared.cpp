#include "oracles/relations/shared.h"

#include <fmt/format.h>

#include <algorithm>

#include "oracles/comparison/state_difference.h"
#include "oracles/oracles.h"

namespace cutproof::oracles {

Verdict judge_relation(const Relation& relation, const Backend& backend, Span span, const Setup& setup,
                       const State& state, const std::function<void(Verdict&)>& check) {
  Verdict verdict = start_verdict(relation.property, state, relation.unit, relation.source);
  verdict.backend = backend.name();
  if (!backend.can_run(span)) {
    vacuous(verdict, span.first == span.last
                         ? fmt::format("the backend cannot run {} by itself", name_of(span.first))
                         : fmt::format("the backend cannot run {} to {}", name_of(span.first), name_of(span.last)));
  }
  if (is_fit(verdict, setup, state) && verdict.vacuous.empty()) check(verdict);
  return conclude(std::move(verdict), relation.nothing);
}

bool is_fit(Verdict& verdict, const Setup& setup, const State& state) {
  const Verdict form = well_formed(setup, state);
  if (!form.holds) fail(verdict, {}, "{}: the state is not well formed: {}", kNotJudged, form.witness.text);
  return form.holds;
}

void vacuous(Verdict& verdict, std::string why) {
  verdict.checked = 0;
  verdict.vacuous = std::move(why);
}

std::vector<State> after_each(Backend& backend, const Setup& setup, const State& state,
                              const std::vector<Span>& spans) {
  std::vector<State> states;
  backend.load({setup}, {state});
  for (const Span span : spans) {
    backend.run(span);
    states.push_back(backend.snapshot().at(0));
  }
  return states;
}

State after(Backend& backend, const Setup& setup, const State& state, Span span) {
  return after_each(backend, setup, state, {span}).back();
}

State after_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  backend.load({setup}, {state});
  for (int64_t frame = 0; frame < frames; ++frame) backend.run(kFrame);
  return backend.snapshot().at(0);
}

Span step_span(const Backend& backend) { return backend.can_run(kStep) ? kStep : kFrame; }

std::optional<Witness> bit_difference(const State& a, const State& b) {
  const std::vector<FieldDifference> all = differences_in_bits(a, b);
  if (all.empty()) return std::nullopt;
  const auto decision = std::find_if(all.begin(), all.end(), [](const auto& found) { return found.is_decision; });
  const FieldDifference& first = decision != all.end() ? *decision : all.front();
  if (!first.is_list) return witness_of({}, "{} differs", first.text);
  switch (first.space) {
    case IndexSpace::particle:
      return witness_of({{}, {static_cast<int32_t>(first.index)}}, "{} of particle {} differs", first.text,
                        first.index);
    case IndexSpace::cluster: {
      Concerned concerned;
      if (at(first.index) < a.clusters.number.size()) concerned.clusters = {a.clusters.number[at(first.index)]};
      return witness_of(concerned, "{} of the cluster in place {} differs", first.text, first.index);
    }
    default:
      return witness_of({}, "{} differs, first in entry {}", first.text, first.index);
  }
}

bool require_same_bits(Verdict& verdict, const std::string& where, const State& expected, const State& actual) {
  auto difference = bit_difference(expected, actual);
  if (!difference) return true;
  verdict.measured = 1;
  difference->text = where + ": " + difference->text;
  fail(verdict, std::move(*difference));
  return false;
}

}  // namespace cutproof::oracles
