#include "oracles/judge.h"

#include <algorithm>

#include "oracles/checks.h"
#include "oracles/shells.h"

namespace cutproof::oracles {

struct Judge::Memory {
  Memory(const Setup& of_setup, PropertyLists of_lists) : setup(of_setup), lists(std::move(of_lists)) {}

  // A verdict that holds, of a state that had the same bits in all parts that it rests on.
  struct Held {
    const Property* property;
    Verdict verdict;
  };

  const Setup& setup;
  const PropertyLists lists;
  bool body_is_known_good = false;
  const State* last = nullptr;
  std::unique_ptr<Judged> judged;  // `last`, where it is well formed
  Verdict form;                    // of `last`
  std::vector<Held> held;

  // Makes `state` the last one, and forgets what rests on parts that have changed.
  void look_at(const State& state) {
    if (&state == last) return;
    // Bounds follow from the rounding, which is no part.
    const bool comparable =
        last != nullptr && last->precision == state.precision && last->place_rounding == state.place_rounding;
    const unsigned changed = comparable ? parts_that_differ(*last, state) : kAll;
    std::erase_if(held, [&](const Held& h) { return (h.property->rests_on & changed) != 0; });
    const bool last_is_good = last != nullptr && form.holds;
    form = conclude(check_form(setup, state,
                               last_is_good         ? kBody | (kAll & ~changed)
                               : body_is_known_good ? kBody
                                                    : 0),
                    core_properties().front().nothing);
    if (form.holds) body_is_known_good = true;
    auto next = std::make_unique<Judged>(setup, state);
    if (last_is_good && form.holds) next->take_over(*judged, changed);
    judged = std::move(next);
    last = &state;
  }

  Verdict answer(const Property& property) {
    if (&property == &core_properties().front()) return form;
    if (!form.holds) return not_judged(property.name, form);
    const auto known = std::find_if(held.begin(), held.end(), [&](const Held& h) { return h.property == &property; });
    if (known != held.end()) {
      Verdict verdict = known->verdict;
      verdict.frame = last->frame;
      verdict.took = {};
      return verdict;
    }
    Verdict verdict = ask(property, *judged);
    if (verdict.holds) held.push_back({&property, verdict});
    return verdict;
  }

  template <class Visit>
  void for_each_property(Visit visit) const {
    for (const PropertyList* list : lists) {
      for (const Property& property : *list) visit(property);
    }
  }
};

Judge::Judge(const Setup& setup, PropertyLists lists) : memory_(std::make_unique<Memory>(setup, std::move(lists))) {}
Judge::~Judge() = default;

std::vector<Verdict> Judge::state(const State& state, Stage after, bool thorough) {
  Memory& m = *memory_;
  m.look_at(state);
  std::vector<Verdict> verdicts;
  m.for_each_property([&](const Property& property) {
    if (property.check_state == nullptr || (property.cost == Cost::thorough && !thorough)) return;
    if (property.due.holds(m.setup, state, after)) verdicts.push_back(m.answer(property));
  });
  for (Verdict& verdict : verdicts) verdict.stage = after;
  return verdicts;
}

std::vector<Verdict> Judge::stage(Stage stage, const State& before, const State& after,
                                  std::span<const RotationKnown> known_rotations) {
  Memory& m = *memory_;
  m.look_at(before);
  const Verdict form_before = m.form;
  m.look_at(after);
  std::vector<Verdict> verdicts;
  m.for_each_property([&](const Property& property) {
    if (!property.promised_by.contains(stage)) return;
    if (property.check_stage != nullptr) {
      verdicts.push_back(ask(property, {m.setup, stage, before, after, known_rotations}, form_before, m.form));
    } else if (property.due.holds(m.setup, after, stage)) {
      verdicts.push_back(m.answer(property));
    }
  });
  for (Verdict& verdict : verdicts) verdict.stage = stage;
  return verdicts;
}

int32_t Judge::component_count(const State& state) {
  memory_->look_at(state);
  return memory_->form.holds ? memory_->judged->components().count : 0;
}

int32_t Judge::inner_shells(const State& state) {
  memory_->look_at(state);
  return memory_->form.holds ? count_shells(state.skin).inner : 0;
}

std::vector<Verdict> judge(const Setup& setup, const State& state, Stage after, bool thorough,
                           const PropertyLists& lists) {
  return Judge(setup, lists).state(state, after, thorough);
}
std::vector<Verdict> judge(const Setup& setup, const State& state, bool thorough, const PropertyLists& lists) {
  return judge(setup, state, Stage::skin, thorough, lists);
}
std::vector<Verdict> judge_stage(const Setup& setup, Stage stage, const State& before, const State& after,
                                 const PropertyLists& lists) {
  return Judge(setup, lists).stage(stage, before, after);
}

}  // namespace cutproof::oracles
