#include "harness/moments.h"

#include <utility>

#include "model/at.h"
#include "model/rules.h"

namespace cutproof::harness {

std::array<bool, 6> due_stages(const Setup& setup, const State& before, Span span, const State& after) {
  std::array<bool, 6> due = {};
  if (before.frame >= setup.frame_count()) return due;
  const bool detects = span.contains(Stage::detect) && needs_detection(setup);
  const bool removed = detects ? !after.removed.empty() : !span.contains(Stage::step) && !before.removed.empty();
  for (const Stage stage : kStages) {
    due[at(stage)] = span.contains(stage) && is_due(setup, stage, removed, before.edge_covered);
  }
  return due;
}

Verdict broken_contract(std::string what, Stage stage, int64_t frame, int32_t body) {
  Verdict verdict;
  verdict.property = std::move(what);
  verdict.stage = stage;
  verdict.frame = frame;
  verdict.body = body;
  verdict.holds = false;
  verdict.measured = 1;
  verdict.unit = "1";
  verdict.bound_source = "model/backend.h";
  verdict.checked = 1;
  return verdict;
}

void count(FrameResult& frame, const State& state) {
  frame.removed += static_cast<int64_t>(state.removed.size());
  frame.debris += static_cast<int64_t>(state.debris.size());
  for (const uint8_t alive : state.alive) frame.alive += alive;
  frame.clusters += state.clusters.count();
  frame.triangles += static_cast<int64_t>(state.skin.triangles.size());
}

}  // namespace cutproof::harness
