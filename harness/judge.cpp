#include "harness/judge.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "harness/cut_again.h"
#include "model/at.h"
#include "model/fields.h"
#include "model/rules.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/shells.h"

namespace cutproof::harness {

namespace {

bool same_sets(const Clusters& a, const Clusters& b) { return a.offsets == b.offsets && a.members == b.members; }

// A span of several stages shows only its end. Fields that no later stage may change give the state after an earlier
// stage exactly; the other fields are those of the state before.

State after_detection(State before, const State& end) {
  before.removed = end.removed;
  for (const int32_t i : end.removed) {
    if (i >= 0 && static_cast<std::size_t>(i) < before.alive.size()) before.alive[at(i)] = 0;
  }
  return before;
}

// Skin makes the skin, compacts numbers and counts up the frame; all other fields are unchanged.
State before_skin(const State& before, const State& end) {
  State state = end;
  state.frame = before.frame;
  state.skin = before.skin;
  if (same_sets(before.clusters, end.clusters)) state.clusters.number = before.clusters.number;
  return state;
}

}  // namespace

// Nothing moves after step, and rotations stay with clusters that stay.
State after_step(const State& before, const State& end) {
  State state = before;
  state.x = end.x;
  state.v = end.v;
  state.impulse = end.impulse;
  state.precision = end.precision;
  state.removed.clear();
  state.debris.clear();
  if (same_sets(before.clusters, end.clusters)) {
    state.clusters.rotation = end.clusters.rotation;
    state.clusters.degenerate = end.clusters.degenerate;
  }
  return state;
}

Judge::Judge(const Setup& setup, std::string backend, Promises promises, Thorough thorough, Depth depth)
    : setup_(setup),
      backend_(std::move(backend)),
      promises_(promises),
      thorough_(thorough),
      judge_(setup, properties_of(depth)) {}
Judge::~Judge() = default;

void Judge::begin(const Snapshot& initial, bool has_expanded) {
  last_ = initial;
  kept_ = {initial};
  frame_ = initial->frame;
  has_expanded_ = has_expanded;
  const Verdict form = oracles::well_formed(setup_, *initial);
  lost_ = !form.holds;
  if (lost_) take({form}, Stage::skin, *initial);
}

int32_t Judge::component_count() {
  const int32_t count = judge_.component_count(*last_);
  kept_ = {last_};
  return count;
}
int32_t Judge::inner_shells() {
  const int32_t count = judge_.inner_shells(*last_);
  kept_ = {last_};
  return count;
}

std::vector<Verdict> Judge::take_verdicts() { return std::exchange(verdicts_, {}); }

void Judge::leave_out(const Verdict& verdict) {
  const auto known = std::find_if(unpromised_.begin(), unpromised_.end(),
                                  [&](const Unpromised& u) { return u.property == verdict.property; });
  Unpromised& entry =
      known != unpromised_.end() ? *known : unpromised_.emplace_back(Unpromised{verdict.property, 0, 0});
  ++entry.states;
  entry.failing += verdict.holds ? 0 : 1;
}

void Judge::add(Verdict verdict) {
  if (!promises_.cover(verdict.property)) return leave_out(verdict);
  verdict.backend = backend_;
  verdicts_.push_back(std::move(verdict));
}

bool Judge::is_promised(const Verdict& verdict, Stage stage, const State& state) const {
  if (!promises_.cover(verdict.property)) return false;
  if (verdict.property == "component match" || verdict.property == "isolation") {
    return promises_.coupling_without_edge_cover || state.edge_covered;
  }
  if (verdict.property == "merge maximality") {
    return promises_.maximality_after_expansion || stage == Stage::merge || !has_expanded_;
  }
  return true;
}

void Judge::take(std::vector<Verdict> found, Stage stage, const State& state) {
  for (Verdict& verdict : found) {
    if (verdict.property == "skin match" && promises_.free_skin_places()) {
      verdict = oracles::free_skin_match(setup_, state, state.skin);
    }
    if (!is_promised(verdict, stage, state)) {
      leave_out(verdict);
      continue;
    }
    verdict.stage = stage;
    verdict.frame = frame_;
    add(std::move(verdict));
  }
}

void Judge::see(const Moment& moment) {
  const State &before = *moment.before, &after = *moment.after;
  const bool ends = moment.span.contains(Stage::skin);
  const bool was_lost = std::exchange(lost_, false);
  const Verdict form = oracles::well_formed(setup_, after);
  if (!form.holds) {
    // Nothing else can be asked of such a state, nor can the next one be compared with it.
    lost_ = true;
    take({form}, moment.span.last, after);
  } else if (after.frame != frame_ + (ends ? 1 : 0)) {
    add(broken_contract("a frame ends with skin and nowhere else", moment.span.last, frame_));
    verdicts_.back().witness.text = "the state after " + std::string(name_of(moment.span.last)) + " of frame " +
                                    std::to_string(frame_) + " is of frame " + std::to_string(after.frame);
    lost_ = true;
  } else if (was_lost && moment.by_backend) {
    take(judge_.state(after, moment.span.last, thorough_ != Thorough::never), moment.span.last, after);
  } else if (moment.by_backend) {
    const std::array<bool, 6> due = due_stages(setup_, before, moment.span, after);
    std::array<bool, 6> seen = due;
    seen[at(Stage::skin)] = ends;  // the end of the frame is looked at whether there is a skin or not
    const auto stages = std::count(seen.begin(), seen.end(), true);
    if (stages > 1) {
      see_several(moment, seen);
    } else if (stages == 1) {
      see_stage(static_cast<Stage>(std::find(seen.begin(), seen.end(), true) - seen.begin()), before, after);
    } else if (!same_bits(before, after)) {
      add(broken_contract("a stage that is not due changes nothing", moment.span.last, frame_));
    }
  } else if (moment.span.contains(Stage::expand) && !same_sets(before.clusters, after.clusters)) {
    has_expanded_ = true;
  }
  if (!lost_ && moment.by_backend) kept_ = {moment.before, moment.after};
  last_ = moment.after;
  if (ends) ++frame_;
}

void Judge::see_stage(Stage stage, const State& before, const State& after,
                      std::span<const oracles::RotationKnown> known_rotations) {
  if (stage == Stage::expand && before.clusters.members != after.clusters.members) has_expanded_ = true;
  std::vector<Verdict> found = judge_.stage(stage, before, after, known_rotations);
  if (stage == Stage::step) return take(std::move(found), stage, after);
  const bool cut = !after.removed.empty() || !after.debris.empty();
  const bool thorough = thorough_ == Thorough::always ||
                        (thorough_ == Thorough::when_cut && setup_.skin.wanted && (cut || !skin_judged_));
  // What the stage promises of the state after it is among what the state itself must be.
  for (Verdict& verdict : judge_.state(after, stage, thorough)) {
    const bool known = std::any_of(found.begin(), found.end(),
                                   [&](const Verdict& other) { return other.property == verdict.property; });
    if (!known) found.push_back(std::move(verdict));
  }
  take(std::move(found), stage, after);
  if (stage == Stage::skin && !setup_.skin.wanted && !(before.skin == after.skin)) {
    add(broken_contract("a stage that is not due changes nothing", stage, frame_));
  }
  skin_judged_ = skin_judged_ || stage == Stage::skin;
}

void Judge::see_several(const Moment& moment, const std::array<bool, 6>& seen) {
  const State& end = *moment.after;
  const Stage last = moment.span.last;
  const auto sees = [&](Stage stage) { return seen[at(stage)]; };
  const bool cuts = sees(Stage::split) || sees(Stage::merge) || sees(Stage::expand);
  // Each stands still until this has returned: judge_ may look at the last two.
  std::vector<std::shared_ptr<State>> between;
  const State* before = moment.before.get();
  State stepped = sees(Stage::step) ? after_step(*before, end) : *before;
  const auto detected = [&] { return sees(Stage::detect) ? after_detection(stepped, end) : stepped; };
  std::vector<oracles::RotationKnown> known_rotations;  // of the state after the step; empty: all are
  std::optional<CutAgain> expected;
  Origins origins;
  if (cuts) {
    expected = cut_again(setup_, detected(), last);
    origins = origins_of(setup_, detected(), last, *expected, end);
    if (sees(Stage::step) && !same_sets(before->clusters, end.clusters)) {
      known_rotations = hand_back(origins, end.clusters, stepped.clusters);
    }
  }
  const auto follow = [&](Stage stage, State state) {
    between.push_back(std::make_shared<State>(std::move(state)));
    see_stage(stage, *before, *between.back(), known_rotations);
    before = between.back().get();
  };
  if (sees(Stage::step)) follow(Stage::step, stepped);
  if (sees(Stage::detect) && (cuts || sees(Stage::skin))) follow(Stage::detect, detected());
  if (sees(Stage::detect) && !cuts && !sees(Stage::skin))
    return see_stage(Stage::detect, *before, end, known_rotations);
  if (cuts) {
    // The effects of these stages cannot be told apart. Together they must give the reference's answer to the same
    // removal, where the rules allow only one.
    const bool unique = promise_of(setup_.merge.rule).unique;
    Verdict verdict;
    verdict.property = "stages in one piece";
    verdict.bound_source = "method.md §5 to §8: the reference's answer to the same removal";
    verdict.unit = "1";
    verdict.checked = unique ? end.clusters.count() : 1;
    if (verdict.checked == 0) verdict.vacuous = "no cluster";
    const auto reject = [&](Witness witness) {
      if (!verdict.holds) return;
      verdict.holds = false;
      verdict.measured = 1;
      verdict.witness = std::move(witness);
    };
    const auto sets = unique ? oracles::Sets::compared : oracles::Sets::open;
    if (auto difference = oracles::difference_of_decisions(expected->state, end, sets)) reject(std::move(*difference));
    const int32_t c = first_that_inherits_otherwise(origins, stepped.clusters, known_rotations, end.clusters);
    if (c >= 0) {
      const int32_t number = end.clusters.number[at(c)];
      std::string from;
      for (const int32_t place : origins[at(c)]) {
        from += (from.empty() ? "" : " or ") + std::to_string(stepped.clusters.number[at(place)]);
      }
      reject(
          {{number},
           {},
           {},
           "cluster " + std::to_string(number) + " has not the rotation of cluster " + from + ", from which it comes"});
    }
    if (!unique && sees(Stage::merge)) {
      // The reference knows one of the rule's answers. The split has one answer, and the oracle identifies merged
      // clusters. Clusters that have grown after that, or lost their numbers at the frame's end, cannot be identified.
      if (sees(Stage::expand) || sees(Stage::skin)) {
        verdict.inconclusive = end.clusters.count();
      } else {
        const State split = cut_again(setup_, detected(), Stage::split).state;
        take({oracles::merge_legality(setup_, split, end), oracles::cap_kept(setup_, split, end)}, Stage::merge, end);
      }
    }
    if (before->clusters.members != end.clusters.members) has_expanded_ = has_expanded_ || sees(Stage::expand);
    take({verdict}, last, end);
    if (!sees(Stage::skin)) return take(judge_.state(end, last, false), last, end);
    between.push_back(std::make_shared<State>(before_skin(*before, end)));
    before = between.back().get();
  }
  see_stage(Stage::skin, *before, end);
}

}  // namespace cutproof::harness
