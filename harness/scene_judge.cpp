#include "harness/scene_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "model/left_stages.h"

namespace cutproof::harness {

SceneJudge::SceneJudge(const Setup& setup, const Expectations& expectations, std::string backend,
                       const Snapshot& initial, Depth depth, Promises promises, Extent extent)
    : setup_(setup),
      depth_(depth),
      judge_(setup, std::move(backend), promises, Thorough::when_cut, depth),
      expectations_(setup, expectations, initial, extent) {
  judge_.begin(initial);
  const bool any = setup.body.particle_count() > 0 && !judge_.is_lost();
  if (any && depth == Depth::motion) as_run_.emplace(setup, *initial);
}

void SceneJudge::see(const Moment& moment) {
  stages_.see(setup_, moment);
  judge_.see(moment);
  expectations_.see(moment);
  if (!as_run_) return;
  if (!moment.by_backend || judge_.is_lost()) {
    as_run_.reset();
  } else if (moment.span.contains(Stage::skin)) {
    as_run_->see(*moment.after);
  }
}

void SceneJudge::stop() {
  is_stopped_ = true;
  expectations_.cut_short();
  note(fmt::format("The run was stopped after {} of {} frames.", judge_.frame(), setup_.frame_count()));
}

void SceneJudge::finish() {
  if (as_run_) {
    // Of each step *motion* asks what *no teleport* asks of a frame.
    std::set<std::string> asked = {"run well formed", "no teleport"};
    for (const Verdict& verdict : judge_.verdicts()) asked.insert(verdict.property);
    for (const Judge::Unpromised& one : judge_.unpromised()) asked.insert(one.property);
    for (Verdict& verdict : as_run_->verdicts()) {
      if (!asked.contains(verdict.property)) judge_.add(std::move(verdict));
    }
  }
  // `missing`: number of missing items.
  const auto whole = [&](const char* what, bool holds, double missing, const std::string& text) {
    Verdict verdict;
    verdict.property = what;
    verdict.frame = std::max<int64_t>(judge_.frame() - 1, 0);
    verdict.holds = holds;
    verdict.measured = missing;
    verdict.unit = "1";
    verdict.bound_source = "oracles.md, A whole run";
    verdict.checked = 1;
    if (!holds) verdict.witness.text = text;
    judge_.add(std::move(verdict));
  };
  // A property that looked at nothing in the whole run has to have said why.
  struct Looked {
    int64_t checked = 0;
    bool excused = false;
  };
  std::map<std::string, Looked> properties;
  for (const Verdict& verdict : judge_.verdicts()) {
    summaries_.add(verdict);
    Looked& looked = properties[verdict.property];
    looked.checked += verdict.checked;
    looked.excused = looked.excused || !verdict.vacuous.empty() || !verdict.holds;
  }
  ExpectationCheck::Judged expected = expectations_.judged(stages_);
  const bool none_reached = expected.verdicts.empty();
  for (Verdict& verdict : expected.verdicts) judge_.add(std::move(verdict));
  not_reached_ = std::move(expected.not_reached);
  not_its_own_ = std::move(expected.not_its_own);
  if (none_reached && !not_reached_.empty()) {
    note("The run ends before any expectation of the scene could be judged.");
  }
  const auto frames = static_cast<double>(setup_.frame_count()), seen = static_cast<double>(judge_.frame());
  if (!is_stopped_)
    whole("the run is whole", seen == frames, frames - seen,
          fmt::format("it ends after frame {} of {}", judge_.frame(), setup_.frame_count()));
  for (const auto& [property, looked] : properties) {
    if (looked.checked > 0 || looked.excused) continue;
    whole("every property looked at something", false, 1,
          fmt::format("'{}' holds, but it judged nothing and gives no reason", property));
  }
  int64_t judged = 0;
  for (const PropertySummary& summary : summaries_.all()) judged += summary.judged;
  const bool is_empty = seen == 0 || setup_.body.particle_count() == 0;
  const bool ran_nothing = !stages_.any_by_backend() && !stages_.left().empty();
  const bool any_judged = judged > 0 && !ran_nothing && !is_empty;
  // A run that is stopped before its first frame ends is not called empty.
  if (any_judged || !is_stopped_)
    whole("something was judged", any_judged, any_judged ? 0 : 1,
          ran_nothing ? "the backend ran no stage: the reference ran all of them for it"
          : is_empty  ? "there was nothing to judge: there are no frames, or the body has no particles"
                      : "no property looked at anything");
}

bool SceneJudge::holds() const {
  const auto& all = verdicts();
  return !is_stopped_ && std::all_of(all.begin(), all.end(), [this](const Verdict& verdict) {
    return verdict.holds || is_expected_failure(verdict);
  });
}

std::vector<std::string> SceneJudge::notes_beside_lists() const {
  std::vector<std::string> notes;
  if (!expectations_.any()) notes.push_back("The scene has no expectations: no outcome was compared.");
  if (depth_ == Depth::topology) {
    notes.push_back("Only the topology was judged, not the motion of each step, and no relations between runs.");
  }
  notes.insert(notes.end(), notes_.begin(), notes_.end());
  return notes;
}

std::vector<std::string> SceneJudge::notes() const {
  std::vector<std::string> notes = notes_beside_lists();
  if (const std::vector<std::string> left = left_to_reference(); !left.empty()) notes.push_back(left_in_words(left));
  for (const Judge::Unpromised& u : judge_.unpromised()) {
    notes.push_back(
        fmt::format("'{}' is not promised here; of {} states it would fail in {}.", u.property, u.states, u.failing));
  }
  return notes;
}

}  // namespace cutproof::harness
