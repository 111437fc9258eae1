#include "harness/frame_runner.h"

namespace cutproof::cli {

FrameResult run_frame(Backend& backend, const SeeState& see, const SeeStage& see_stage) {
  FrameResult result;
  const auto run = [&](Span span) {
    backend.run(span);
    const SpanReport report = backend.report();
    result.total_seconds += report.total_seconds;
    for (const Stage stage : kStages) {
      const auto s = static_cast<std::size_t>(stage);
      result.ran[s] = result.ran[s] || report.ran[s];
      result.seconds[s] += report.seconds[s];
    }
  };
  const auto ran = [&](Stage stage) { return result.ran[static_cast<std::size_t>(stage)]; };

  const auto run_stage = [&](Stage stage) {
    run({stage, stage});
    if (see_stage) {
      see_stage(stage, backend.snapshot().front(), backend.report().ran[static_cast<std::size_t>(stage)]);
    }
  };

  if (!see && !see_stage) {
    run({Stage::step, Stage::skin});
  } else {
    run_stage(Stage::step);
    run_stage(Stage::detect);
    const bool cut = see && ran(Stage::detect) && !backend.snapshot().front().removed.empty();
    if (cut) see(Stage::detect, backend.snapshot().front());
    for (const Stage stage : {Stage::split, Stage::merge, Stage::expand}) {
      run_stage(stage);
      if (cut && ran(stage)) see(stage, backend.snapshot().front());
    }
    run_stage(Stage::skin);
  }
  const State state = backend.snapshot().front();
  if (see) see(Stage::skin, state);
  result.frame = state.frame - 1;
  result.removed = static_cast<int64_t>(state.removed.size());
  result.debris = static_cast<int64_t>(state.debris.size());
  for (const uint8_t alive : state.alive) result.alive += alive;
  result.clusters = state.clusters.count();
  result.triangles = static_cast<int64_t>(state.skin.triangles.size());
  return result;
}

}  // namespace cutproof::cli
