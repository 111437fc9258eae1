// Judges the run of a scene: every property of every moment, those of any simulator's run that no moment was asked,
// what the scene expects, and that the run was whole. `run
// --check` and `check` feed it the same moments, so they give the same verdicts.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "harness/expectations.h"
#include "harness/judge.h"
#include "harness/property_summary.h"
#include "harness/scene_as_run.h"

namespace cutproof::harness {

class SceneJudge {
 public:
  // `setup` must outlive this. `initial` is the state as loaded. Who says nothing about the depth judges by everything,
  // and by all that a scene promises.
  SceneJudge(const Setup& setup, const Expectations& expectations, std::string backend, const Snapshot& initial,
             Depth depth = Depth::motion, Promises promises = {}, Extent extent = Extent::whole);

  void see(const Moment& moment);
  // Of somebody else's: a broken contract, or a relation between runs.
  void add(Verdict verdict) { judge_.add(std::move(verdict)); }
  // A sentence that the reader of the verdicts has to know as well.
  void note(std::string sentence) { notes_.push_back(std::move(sentence)); }

  // Nothing comes after this but finish(): somebody stopped the run. What was judged stands, and the whole does not
  // hold.
  void stop();
  bool is_stopped() const { return is_stopped_; }
  // After the last moment: what the scene expects, whether the run came to the end of its schedule, and whether each
  // property that applied looked at anything at all. A run of which nothing was judged does not hold, nor does one in
  // which the backend ran no stage.
  void finish();

  const std::vector<Verdict>& verdicts() const { return judge_.verdicts(); }
  // What the verdicts came to by property and stage, without those on the run as a whole and on what a scene expects.
  // Complete after finish().
  const PropertySummaries& summaries() const { return summaries_; }
  bool holds() const;
  bool is_expected_failure(const Verdict& verdict) const { return expectations_.is_expected_failure(verdict); }
  const std::vector<Judge::Unpromised>& unpromised() const { return judge_.unpromised(); }
  // What the scene expects of frames and strokes that a run that is cut short has not reached: neither failures nor
  // passes. Complete after finish().
  const std::vector<std::string>& not_reached() const { return not_reached_; }
  // The stages that the backend cannot run, so that the reference did: none of them was judged. Complete after the last
  // moment.
  std::vector<std::string> left_to_reference() const { return stages_.left(); }
  // What the scene expects and only such stages decide: neither failures nor passes. Complete after finish().
  const std::vector<std::string>& not_its_own() const { return not_its_own_; }
  // What a reader of the verdicts has to know, one sentence each: that the scene expects nothing, what was not judged,
  // which properties were not promised.
  std::vector<std::string> notes() const;
  // The same but for those on promises and on stages that were left to the reference, of which unpromised(),
  // left_to_reference() and not_its_own() say more.
  std::vector<std::string> notes_beside_lists() const;

 private:
  const Setup& setup_;
  Depth depth_;
  Judge judge_;
  PropertySummaries summaries_;
  StagesRun stages_;
  std::optional<SceneAsRun> as_run_;
  std::vector<std::string> notes_, not_reached_, not_its_own_;
  ExpectationCheck expectations_;
  bool is_stopped_ = false;
};

}  // namespace cutproof::harness
