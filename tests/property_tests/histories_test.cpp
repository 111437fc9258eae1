// Each of what a history asks for beyond the oracles rejects a backend that breaks it, and histories come back from
// their JSON.
#include "property_tests/histories.h"

#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "gpu/backends.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests {
namespace {

// The reference, and what goes wrong in it. Nothing of it is an error of a single stage.
struct Faults {
  std::function<void(State&)> on_load;                     // what a load makes of a state
  std::function<void(State&)> on_snapshot;                 // what is shown of it
  std::function<void(Span, int loads, State&)> after_run;  // loads: how often this backend has been loaded
};

class Faulty final : public Backend {
 public:
  explicit Faulty(Faults faults) : faults_(std::move(faults)) {}
  std::string name() const override { return "faulty"; }
  bool can_run(Span span) const override { return inner_->can_run(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    for (std::size_t b = 0; b < states.size() && faults_.on_load; ++b) faults_.on_load(states[b]);
    setups_ = setups;
    ++loads_;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    inner_->run(span);
    report_ = inner_->report();
    if (!faults_.after_run) return;
    std::vector<State> states = inner_->snapshot();
    for (State& state : states) faults_.after_run(span, loads_, state);
    inner_->load(setups_, std::move(states));
  }
  std::vector<State> snapshot() const override {
    std::vector<State> states = inner_->snapshot();
    for (std::size_t b = 0; b < states.size() && faults_.on_snapshot; ++b) faults_.on_snapshot(states[b]);
    return states;
  }
  SpanReport report() const override { return report_; }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  Faults faults_;
  std::vector<Setup> setups_;
  SpanReport report_;
  int loads_ = 0;
};

// A wire of eight particles in two clusters' reach, cut apart in its middle by the first frame.
Case wire() {
  Case c;
  for (int32_t i = 0; i < 8; ++i) c.nodes.push_back({i, 0, 0});
  c.side = 3;
  c.strokes = {{{14, -4, -4}, {14, -4, 4}, 2, true, Link::apart}};
  return c;
}

const Command kFrame = RunStages{6, false};
const Command kToSplit = RunStages{2, false};  // step and detect

std::string failed_property(const Faults& faults, const std::vector<Command>& commands) {
  const History history = history_of([faults] { return std::make_unique<Faulty>(faults); }, wire(), commands);
  return history.failure() ? history.failure()->property : "";
}

TEST(Histories, HoldOnTheReferenceAndOnKernels) {
  const std::vector<Command> commands = {
      kToSplit, SaveAndLoad{true},  RunStages{4, true}, Kick{1, {3, 0, 0}}, SaveAndLoad{false}, RunStages{1, false},
      Cut{{}},  Kick{0, {0, 2, 0}}, RunStages{9, true}};
  for (const auto& make :
       {History::Source(reference::make_backend), History::Source([] { return gpu::make_host_backend(1); })}) {
    const History history = history_of(make, wire(), commands);
    HistoryCoverage seen = history.coverage();
    EXPECT_FALSE(history.failure()) << describe(*history.failure());
    EXPECT_EQ(history.position(), (Position{2, Stage::expand}));
    for (const char* what : {"load before split", "kick beside other components", "cut with and without a load"}) {
      EXPECT_GT(seen[what], 0) << what;
    }
  }
}

TEST(Histories, RejectALoadThatForgets) {
  const Faults forgets_cut = {[](State& state) { state.removed.clear(); }, {}, {}};
  EXPECT_EQ(failed_property(forgets_cut, {kToSplit, SaveAndLoad{}, RunStages{4, false}}), "loading changes nothing");
  EXPECT_EQ(failed_property(forgets_cut, {kToSplit, SaveAndLoad{true}}), "loading changes nothing");
  EXPECT_EQ(failed_property(forgets_cut, {kToSplit, Kick{}}), "loading changes nothing");
  EXPECT_EQ(failed_property(forgets_cut, {RunStages{1, false}, SaveAndLoad{}}), "");  // nothing to forget
}

// No snapshot shows it: what was loaded a second time goes on otherwise, by less than any bound.
TEST(Histories, RejectAStateThatALoadDoesNotRestore) {
  const Faults drifts = {{}, {}, [](Span span, int loads, State& state) {
                           if (span.contains(Stage::step) && loads > 1) state.v[0].x += 1e-300;
                         }};
  EXPECT_EQ(failed_property(drifts, {kFrame}), "");
  EXPECT_EQ(failed_property(drifts, {SaveAndLoad{}, kFrame}), "same input, same bits");
}

TEST(Histories, RejectASpanThatIsNotTheCompositionOfItsStages) {
  const Faults whole_frames = {{}, {}, [](Span span, int, State& state) {
                                 if (span.first != span.last && !state.v.empty()) state.v[0].x += 1e-9;
                               }};
  EXPECT_EQ(failed_property(whole_frames, {kFrame}), "");
  EXPECT_EQ(failed_property(whole_frames, {RunStages{6, true}}), "a span is the composition of its stages");
}

// The last particle, which the first frame has cut off, takes the first one along a little.
TEST(Histories, RejectAGhostForce) {
  const Faults ghost = {{}, {}, [](Span span, int, State& state) {
                          if (span.contains(Stage::step)) state.v.front() += 1e-6 * state.v.back();
                        }};
  EXPECT_EQ(failed_property(ghost, {kFrame, RunStages{6, true}}), "");  // nothing moves
  EXPECT_EQ(failed_property(ghost, {kFrame, Kick{1, {4, 0, 0}}}), "no ghost force");
}

// Both backends have been asked once, for what they made of the first state.
TEST(Histories, RejectASnapshotThatChangesSomething) {
  const auto calls = std::make_shared<int>(0);
  const Faults wears = {{}, [calls](State& state) { state.cap += ++*calls > 2; }, {}};
  EXPECT_EQ(failed_property(wears, {SaveAndLoad{}}), "a snapshot changes nothing");
}

TEST(Histories, ComeBackFromJsonAsTheyWere) {
  const std::vector<Command> commands = {RunStages{7, true}, Cut{{{1, -2, 3}, {4, 5, -6}, 3, false, Link::retraced}},
                                         Kick{2, {-1, 0, 4}}, SaveAndLoad{true}, SaveAndLoad{false}};
  std::string list;
  for (const Command& command : commands) list += (list.empty() ? "[" : ",") + to_json(command);
  EXPECT_EQ(commands_from_json(list + "]"), commands);
  for (const char* bad : {"[{}]", "nothing", "{\"run\": 3}", "[{\"run\": 0, \"whole\": true}]",
                          "[{\"run\": 1, \"whole\": true, \"more\": 1}]", "[{\"save_and_load\": \"tape\"}]",
                          "[{\"kick\": -1, \"velocity\": [0, 0, 0]}]", "[{\"kick\": 0, \"velocity\": [5000, 0, 0]}]",
                          "[{\"cut\": {\"from\": [0, 0, 0]}}]"}) {
    EXPECT_THROW(commands_from_json(bad), std::invalid_argument) << bad;
  }
}

}  // namespace
}  // namespace cutproof::property_tests
