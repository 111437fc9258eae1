// Judges the run of a scene: every property of every moment, further properties of any simulator's run, the scene's
// expectations, and completeness. `run --check` and `check` judge the same moments, so they give the same verdicts.
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
  // `setup` must outlive this. `initial` is the state as loaded. The default depth judges every property that a scene
  // promises.
  SceneJudge(const Setup& setup, const Expectations& expectations, std::string backend, const Snapshot& initial,
             Depth depth = Depth::motion, Promises promises = {}, Extent extent = Extent::whole);

  void see(const Moment& moment);
  // Adds another verdict: a broken contract, or a relation between runs.
  void add(Verdict verdict) { judge_.add(std::move(verdict)); }
  // A sentence that the reader of the verdicts has to know as well.
  void note(std::string sentence) { notes_.push_back(std::move(sentence)); }

  // The run was stopped; only finish() may follow. The verdicts stay, and the run as a whole does not hold.
  void stop();
  bool is_stopped() const { return is_stopped_; }
  // After the last moment: the scene's expectations, whether the run reached the end of its schedule, and whether each
  // applicable property judged anything. A run without any judgement does not hold, nor does one in which the backend
  // ran no stage.
  void finish();

  const std::vector<Verdict>& verdicts() const { return judge_.verdicts(); }
  // Summary of the verdicts by property and stage, without those on the whole run and on expectations. Complete after
  // finish().
  const PropertySummaries& summaries() const { return summaries_; }
  bool holds() const;
  bool is_expected_failure(const Verdict& verdict) const { return expectations_.is_expected_failure(verdict); }
  const std::vector<Judge::Unpromised>& unpromised() const { return judge_.unpromised(); }
  // Expectations on frames and strokes that the run has not reached: neither failures nor passes. Complete after
  // finish().
  const std::vector<std::string>& not_reached() const { return not_reached_; }
  // The stages that the backend cannot run, so that the reference did: none of them was judged. Complete after the last
  // moment.
  std::vector<std::string> left_to_reference() const { return stages_.left(); }
  // Expectations that only such stages decide: neither failures nor passes. Complete after finish().
  const std::vector<std::string>& not_its_own() const { return not_its_own_; }
  // Notes for the reader of the verdicts, one sentence each: a scene without expectations, and properties that were not
  // judged or not promised.
  std::vector<std::string> notes() const;
  // The same without the notes on promises and on stages that the reference ran; unpromised(), left_to_reference() and
  // not_its_own() have the details.
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
