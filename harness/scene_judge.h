// Judges the run of a scene: every property of every moment, what the scene expects, and that the run was whole. `run
// --check` and `check` feed it the same moments, so they give the same verdicts.
#pragma once
#include <string>
#include <vector>

#include "harness/expectations.h"
#include "harness/judge.h"

namespace cutproof::harness {

class SceneJudge {
 public:
  // `setup` must outlive this. `initial` is the state as loaded.
  SceneJudge(const Setup& setup, const Expectations& expectations, std::string backend, const Snapshot& initial);

  void see(const Moment& moment);
  void add(Verdict verdict) { judge_.add(std::move(verdict)); }  // such as a broken contract

  // After the last moment: what the scene expects, whether the run came to the end of its schedule, and whether each
  // property that applied looked at anything at all. A run of which nothing was judged does not hold.
  void finish();

  const std::vector<Verdict>& verdicts() const { return judge_.verdicts(); }
  bool holds() const;
  bool is_expected_failure(const Verdict& verdict) const { return expectations_.is_expected_failure(verdict); }
  // What a reader of the verdicts has to know, one sentence each: that the scene expects nothing, which properties were
  // not promised.
  std::vector<std::string> notes() const;

 private:
  const Setup& setup_;
  Judge judge_;
  ExpectationCheck expectations_;
};

}  // namespace cutproof::harness
