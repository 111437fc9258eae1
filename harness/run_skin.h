// The skin of a run of another simulator, judged where it is new or where the blade has swept (tolerances.md, Runs).
#pragma once
#include <optional>
#include <vector>

#include "harness/foreign_judge.h"
#include "harness/foreign_run.h"

namespace cutproof::harness {

class RunSkin {
 public:
  // After `judge` has seen the frame.
  void see(const RunFrames& frames, const oracles::RunJudge& judge);
  // Adds verdicts and notes on properties that were not judged; nothing for a run without a skin.
  void finish(bool is_promised, JudgedRun& judged) const;

 private:
  void take(std::optional<Verdict>& known, Verdict verdict, int64_t frame);
  std::optional<Verdict> surface_, match_;
};

}  // namespace cutproof::harness
