#include "harness/frame_runner.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "model/at.h"
#include "oracles/comparison/state_difference.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

namespace {

Stage stage_at(std::size_t index) { return static_cast<Stage>(index); }

}  // namespace

std::vector<PlannedSpan> plan_spans(const Backend& backend, Span span, bool finest) {
  // Best way to come to each boundary between stages: stages that the backend runs, then pieces.
  struct Way {
    int stages = -1, pieces = 0;
    std::size_t from = 0;
    bool by_backend = true;
  };
  const std::size_t first = at(span.first), end = at(span.last) + 1;
  std::array<Way, 7> ways;
  ways[first] = {0, 0, first, true};
  for (std::size_t to = first + 1; to <= end; ++to) {
    const auto offer = [&](std::size_t from, bool by_backend) {
      const Way& before = ways[from];
      const Way way = {before.stages + (by_backend ? static_cast<int>(to - from) : 0),
                       before.pieces + (finest ? 1 : -1), from, by_backend};
      if (std::pair(way.stages, way.pieces) > std::pair(ways[to].stages, ways[to].pieces) || ways[to].stages < 0) {
        ways[to] = way;
      }
    };
    offer(to - 1, false);
    for (std::size_t from = first; from < to; ++from) {
      if (backend.can_run({stage_at(from), stage_at(to - 1)})) offer(from, true);
    }
  }
  std::vector<PlannedSpan> plan;
  for (std::size_t to = end; to > first; to = ways[to].from) {
    plan.push_back({{stage_at(ways[to].from), stage_at(to - 1)}, ways[to].by_backend});
  }
  std::reverse(plan.begin(), plan.end());
  return plan;
}

std::array<bool, 6> left_to_reference(const Backend& backend) {
  std::array<bool, 6> left = {};
  for (const PlannedSpan& piece : plan_spans(backend, {}, true)) {
    if (!piece.by_backend) left[at(piece.span.first)] = true;  // it is a stage by itself
  }
  return left;
}

FrameRunner::FrameRunner(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states)
    : backend_(backend), setups_(std::move(setups)) {
  backend_.load(setups_, states);
  for (State& state : backend_.snapshot()) present_.push_back(std::make_shared<const State>(std::move(state)));
  if (present_.size() != setups_.size()) {
    throw std::runtime_error("The backend " + backend_.name() + " gave " + std::to_string(present_.size()) +
                             " states of " + std::to_string(setups_.size()) + " bodies.");
  }
}

FrameRunner::~FrameRunner() = default;

bool FrameRunner::is_over() const {
  for (std::size_t b = 0; b < setups_.size(); ++b) {
    if (present_[b]->frame < setups_[b].frame_count()) return false;
  }
  return true;
}

void FrameRunner::hand_over(bool to_backend) {
  if (to_backend == at_backend_) return;
  const std::vector<State> states = snapshot();  // without an observer present_ is that of an earlier piece
  if (!to_backend && !reference_) reference_ = reference::make_backend();
  (to_backend ? backend_ : *reference_).load(setups_, states);
  at_backend_ = to_backend;
  // Loading into single precision rounds, and the next span begins with rounded values; decisions are not rounded.
  std::vector<State> taken = snapshot();
  for (std::size_t b = 0; b < taken.size(); ++b) {
    if (taken[b] == states[b]) continue;
    const bool rounds = to_backend && backend_.precision() != Precision::binary64;
    if (!rounds || oracles::difference_of_decisions(states[b], taken[b], oracles::Sets::compared)) {
      broken_.push_back(
          broken_contract("loading changes nothing", Stage::step, states[b].frame, static_cast<int32_t>(b)));
    }
    present_[b] = std::make_shared<const State>(std::move(taken[b]));
  }
}

std::vector<State> FrameRunner::snapshot_of(const std::vector<bool>& wanted) const {
  return (at_backend_ ? backend_ : *reference_).snapshot_of(wanted);
}

SpanReport FrameRunner::run_piece(const PlannedSpan& piece) {
  hand_over(piece.by_backend);
  Backend& runner = piece.by_backend ? backend_ : *reference_;
  runner.run(piece.span);
  const SpanReport report = runner.report();
  frame_.total_seconds += report.total_seconds;
  for (const Stage stage : kStages) {
    frame_.ran[at(stage)] = frame_.ran[at(stage)] || report.ran[at(stage)];
    frame_.seconds[at(stage)] += report.seconds[at(stage)];
  }
  return report;
}

void FrameRunner::run(Span span, const Observer& observe) {
  frame_ = {};
  const std::size_t bodies = setups_.size();
  for (const PlannedSpan& piece : plan_spans(backend_, span, observe != nullptr)) {
    std::vector<bool> goes_on(bodies);
    for (std::size_t b = 0; b < bodies; ++b) goes_on[b] = present_[b]->frame < setups_[b].frame_count();
    const SpanReport report = run_piece(piece);
    if (!observe) continue;
    // The due stages after a detection within the piece depend on its removals.
    std::array<bool, 6> due = {};
    std::vector<State> states;
    const bool detects = piece.span.contains(Stage::detect) && piece.span.last > Stage::detect;
    const auto add_due = [&](std::size_t b, const State& after) {
      const auto of_body = due_stages(setups_[b], *present_[b], piece.span, after);
      for (const Stage stage : kStages) due[at(stage)] = due[at(stage)] || of_body[at(stage)];
    };
    if (detects) states = snapshot_of(goes_on);
    for (std::size_t b = 0; b < bodies; ++b) {
      if (goes_on[b]) add_due(b, detects ? states[b] : *present_[b]);
    }
    for (const Stage stage : kStages) {
      if (!piece.span.contains(stage) || !piece.by_backend || report.ran[at(stage)] == due[at(stage)]) continue;
      broken_.push_back(broken_contract(due[at(stage)] ? "a stage that is due runs" : "only what is due runs", stage,
                                        present_.empty() ? 0 : present_.front()->frame));
    }
    // Where no body had anything to do, looking once a frame shows that nothing was done: at its end.
    const bool any_due = std::any_of(due.begin(), due.end(), [](bool d) { return d; });
    if (!any_due && !piece.span.contains(Stage::skin)) continue;
    if (states.empty()) states = snapshot_of(goes_on);
    for (std::size_t b = 0; b < bodies; ++b) {
      if (!goes_on[b]) continue;
      const auto after = std::make_shared<const State>(std::move(states[b]));
      const Moment moment = {static_cast<int32_t>(b), piece.span, std::exchange(present_[b], after), after,
                             piece.by_backend};
      observe(moment);
    }
  }
  if (observe) return;
  std::vector<State> states = snapshot();
  for (std::size_t b = 0; b < bodies; ++b) present_[b] = std::make_shared<const State>(std::move(states[b]));
}

FrameResult FrameRunner::run_frame(const Observer& observe) {
  const int64_t frame = present_.empty() ? 0 : present_.front()->frame;
  run({Stage::step, Stage::skin}, observe);
  frame_.frame = frame;
  for (const Snapshot& state : present_) count(frame_, *state);
  return frame_;
}

void FrameRunner::look_again() {
  const std::vector<State> last = snapshot();
  for (std::size_t b = 0; b < last.size(); ++b) {
    if (last[b] == *present_[b]) continue;
    broken_.push_back(broken_contract("a body whose schedule is over stays as it is", Stage::skin, present_[b]->frame,
                                      static_cast<int32_t>(b)));
  }
}

std::vector<Verdict> FrameRunner::take_broken_contracts() { return std::exchange(broken_, {}); }

Traces run_to_the_end(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states) {
  FrameRunner runner(backend, std::move(setups), states);
  Traces traces;
  for (const Snapshot& state : runner.states()) traces.of_body.push_back({state, {}});
  const auto keep = [&](const Moment& moment) { traces.of_body[at(moment.body)].moments.push_back(moment); };
  while (!runner.is_over()) runner.run_frame(keep);
  runner.look_again();
  traces.broken_contracts = runner.take_broken_contracts();
  return traces;
}

}  // namespace cutproof::harness
