#include "harness/moments.h"

#include <algorithm>
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

void StagesRun::see(const Setup& setup, const Moment& moment) {
  const std::array<bool, 6> due = due_stages(setup, *moment.before, moment.span, *moment.after);
  std::array<int64_t, 6>& counts = moment.by_backend ? by_backend : by_reference;
  for (std::size_t s = 0; s < due.size(); ++s) counts[s] += due[s] ? 1 : 0;
}

void StagesRun::join(const StagesRun& other) {
  for (std::size_t s = 0; s < by_backend.size(); ++s) {
    by_backend[s] += other.by_backend[s];
    by_reference[s] += other.by_reference[s];
  }
}

bool StagesRun::any_by_backend() const {
  return std::any_of(by_backend.begin(), by_backend.end(), [](int64_t count) { return count > 0; });
}

bool StagesRun::is_left(Stage stage) const { return by_reference[at(stage)] > 0 && by_backend[at(stage)] == 0; }

std::vector<std::string> StagesRun::left() const {
  std::vector<std::string> names;
  for (const Stage stage : kStages) {
    if (is_left(stage)) names.emplace_back(name_of(stage));
  }
  return names;
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
