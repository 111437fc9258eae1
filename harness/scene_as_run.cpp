#include "harness/scene_as_run.h"

#include <algorithm>
#include <utility>

#include "harness/run_frames.h"

namespace cutproof::harness {

SceneAsRun::SceneAsRun(const Setup& setup, const State& initial)
    : segments_(setup, initial.precision, io::StateSegments::WithSkin::no) {
  see(initial);
}

void SceneAsRun::see(const State& state) {
  const RunSegment segment(segments_.next(state), "", frame_++);
  if (!judge_) {
    judge_.emplace(segment.header());
    judge_->weigh(segment.mass());
  }
  if (auto coupling = segment.coupling()) judge_->couple(std::move(*coupling));
  judge_->see(segment.frame(0));
}

std::vector<Verdict> SceneAsRun::verdicts() {
  judge_->finish();
  std::vector<Verdict> all = judge_->verdicts();
  for (Verdict& verdict : all) verdict.frame = std::max<int64_t>(verdict.frame, 0);
  return all;
}

}  // namespace cutproof::harness
