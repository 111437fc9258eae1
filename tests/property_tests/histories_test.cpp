// Each of what a history asks for beyond the oracles rejects a backend that breaks it, and histories come back from
// their JSON.
#include "property_tests/histories.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gpu/backends.h"
#include "gpu/host/thread_schedule.h"
#include "gpu/load.h"
#include "model/error.h"
#include "model/fields.h"
#include "property_tests/shown_case.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests::histories_test {
namespace {

// The reference, and what goes wrong in it. Nothing of it is an error of a single stage.
struct Faults {
  std::function<void(State&)> on_load = {};                     // what a load makes of a state
  std::function<void(State&)> on_snapshot = {};                 // what is shown of it
  std::function<void(Span, int loads, State&)> after_run = {};  // loads: how often this backend has been loaded
  std::function<void(std::vector<State>&)> on_snapshots = {};   // the same of all bodies of a load
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
    if (faults_.on_snapshots) faults_.on_snapshots(states);
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
  try {
    const History history = history_of([faults] { return std::make_unique<Faulty>(faults); }, wire(), commands);
    return history.failure() ? history.failure()->property : "";
  } catch (const std::invalid_argument& error) {  // what it has come to cannot be loaded
    return error.what();
  }
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

// For somebody to look at: every stage that ran, over loads, kicks and strokes that came later.
TEST(Histories, AreShownMomentByMoment) {
  const std::vector<Command> commands = {kToSplit,           SaveAndLoad{true}, RunStages{4, true},
                                         Kick{1, {3, 0, 0}}, Cut{{}},           RunStages{7, false}};
  const ShownCase shown = run_to_show(reference::make_backend, wire(), commands);
  EXPECT_EQ(shown.problem, "");
  ASSERT_TRUE(shown.trace.initial);
  std::vector<std::pair<int64_t, Stage>> seen;
  for (const harness::Moment& moment : shown.trace.moments) seen.emplace_back(moment.before->frame, moment.span.last);
  ASSERT_FALSE(seen.empty());
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end())) << "each goes on where the one before ended";
  EXPECT_EQ(seen.front(), std::pair(int64_t{0}, Stage::step));
  EXPECT_EQ(seen.back(), std::pair(int64_t{2}, Stage::step));
  EXPECT_GE(shown.loaded.setup.frame_count(), 3) << "the setup knows the strokes that came later";
  EXPECT_EQ(in_words(commands),
            "2 stages, then saved and loaded through files, then 4 stages as one span, then a kick of piece 1, then "
            "one more stroke, then 7 stages");
  // Up to where it fails; what was judged keeps no moments.
  const Faults stops = {{}, {}, [](Span span, int, State& state) {
                          if (span.contains(Stage::detect) && !state.x.empty()) state.x[0].x = 1e9;
                        }};
  const auto make = [&] { return std::make_unique<Faulty>(stops); };
  const ShownCase stopped = run_to_show(make, wire(), commands);
  EXPECT_EQ(stopped.problem, "");
  ASSERT_FALSE(stopped.trace.moments.empty());
  EXPECT_EQ(stopped.trace.moments.back().span.last, Stage::detect);
  EXPECT_TRUE(history_of(reference::make_backend, wire(), commands).trace().moments.empty());
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

// One bit of the first entry, or of the last; or an entry where there is none.
template <class T>
void change_a_bit(T& value, bool last = false) {
  if constexpr (requires { value.emplace_back(); }) {
    if (value.empty()) {
      value.emplace_back();
    } else {
      change_a_bit(last ? value.back() : value.front());
    }
  } else if constexpr (std::is_same_v<T, bool>) {
    value = !value;
  } else {
    static_assert(std::is_trivially_copyable_v<T>);
    *reinterpret_cast<unsigned char*>(&value) ^= 1;
  }
}

template <class Visit>
void for_each_field_by_index(Visit&& visit) {
  std::size_t index = 0;
  for_each_field([&](const Field& field, auto) { visit(field, index++); });
}
void change_field(State& state, std::size_t index, bool last = false) {
  std::size_t k = 0;
  for_each_field([&](const Field&, auto get) {
    if (k++ == index) change_a_bit(get(state), last);
  });
}

// Whatever a backend shows, of whichever field, is compared with what it showed before, with what another one shows, or
// with what was recorded. Stage by stage, or nobody looks at every snapshot.
TEST(Histories, SeeEachFieldOfEachSnapshotChangedAlone) {
  std::vector<Command> commands;
  for (int stage = 0; stage < 9; ++stage) {
    commands.push_back(RunStages{1, stage % 2 == 0});
    if (stage == 1 || stage == 6) commands.push_back(SaveAndLoad{stage == 6});
  }
  const auto snapshots = std::make_shared<int>(0);
  EXPECT_EQ(failed_property({{}, [snapshots](State&) { ++*snapshots; }, {}, {}}, commands), "");
  const int count = std::exchange(*snapshots, 0);
  ASSERT_GT(count, 20);
  for (int changed = 1; changed <= count; ++changed) {
    for_each_field_by_index([&](const Field& field, std::size_t index) {
      *snapshots = 0;
      const Faults fault = {{},
                            [=](State& state) {
                              if (++*snapshots == changed) change_field(state, index);
                            },
                            {},
                            {}};
      EXPECT_NE(failed_property(fault, commands), "") << field.name << ", snapshot " << changed << " of " << count;
    });
  }
}

// The first frame cuts the wire in two. Where the second part is kicked, the first entry of everything belongs to the
// other one; where the first is, the last one does. The impulse is a sum over both.
TEST(Histories, SeeAGhostForceInEachField) {
  for_each_field_by_index([&](const Field& field, std::size_t index) {
    for (const bool last : {false, true}) {
      if (last && field.space == IndexSpace::state) continue;  // these have no entries that are of a part
      const Faults ghost = {{}, {}, {}, [=](std::vector<State>& states) {
                              if (states.size() == 2) change_field(states[1], index, last);
                            }};
      EXPECT_EQ(failed_property(ghost, {kFrame, Kick{last ? 0 : 1, {4, 0, 0}}}),
                field.quantity == Quantity::momentum ? "" : "no ghost force")
          << field.name << (last ? ", last entry" : "");
    }
  });
}

// What is kicked may be removed, turn and move: none of that is a ghost.
TEST(Histories, LetAKickDoWhatItDoesToItsOwnComponent) {
  const Faults own = {{}, {}, {}, [](std::vector<State>& states) {
                        if (states.size() != 2) return;
                        State& pushed = states[1];
                        pushed.x.back().z += 1;
                        pushed.v.back().z += 1;
                        pushed.alive.back() = 0;
                        pushed.removed.push_back(static_cast<int32_t>(pushed.x.size()) - 1);
                        pushed.clusters.rotation.back() = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
                        pushed.clusters.degenerate.back() = 1;
                        pushed.impulse.x += 1;
                      }};
  EXPECT_EQ(failed_property(own, {kFrame, Kick{1, {4, 0, 0}}}), "");
}

// Kernels that begin with room for nothing but what was loaded, on a block in clusters of 27 particles that is cut in
// two. Room doubles before a span: by stages six times a frame, by whole frames once; so the two backends of a history
// grow apart, and what they make of the block must not.
TEST(Histories, HoldInRoomsThatGrowAgainAndAgain) {
  constexpr double kTiny = 1.0 / 1024;
  Case block;
  for (int32_t z = 0; z < 4; ++z) {
    for (int32_t y = 0; y < 5; ++y) {
      for (int32_t x = 0; x < 6; ++x) block.nodes.push_back({x, y, z});
    }
  }
  std::sort(block.nodes.begin(), block.nodes.end());
  block.side = 1;
  constexpr int32_t kPauses = 12;
  const Stroke pause{{0, 0, 0}, {0, 0, 0}, 4, false, Link::apart};
  for (const int32_t x : {10, 4}) {
    block.strokes.insert(block.strokes.end(), kPauses, pause);
    block.strokes.push_back({{x, -20, -20}, {x, 20, -20}, 4, true, Link::apart});
  }

  gpu::KernelOptions tiny;
  tiny.capacity.factor = kTiny;
  // Each load begins in the tiny room again.
  const int32_t to_the_cut = 6 * (kPauses + 1);
  const std::vector<Command> commands = {RunStages{to_the_cut, true}, SaveAndLoad{false}, RunStages{to_the_cut, false}};
  const auto holds = [&](const History::Source& make) {
    const History history = history_of(make, block, commands);
    EXPECT_FALSE(history.failure()) << describe(*history.failure());
    HistoryCoverage seen = history.coverage();
    EXPECT_GT(seen["cut in one span"], 0);
  };
  holds([&] { return gpu::make_host_backend(1, tiny); });
  holds([&] { return gpu::make_simulated_backend({.schedule = gpu::random_walk(1)}, tiny); });
  // As often as it takes, and what was loaded alone is not enough for the cut: so the room above did grow.
  const Instance loaded = instance_of(block);
  gpu::Load load({loaded.setup}, {loaded.state}, tiny, tiny.capacity);
  for (double factor = 2 * kTiny; factor <= 1; factor *= 2) {
    const gpu::Extents before = load.staging;
    load = load.enlarged(load.states_of({true}), tiny);
    EXPECT_EQ(load.capacity.factor, factor);
    EXPECT_GE(load.staging.member_capacity, before.member_capacity);
  }
  EXPECT_EQ(load.staging.member_capacity, gpu::Load({loaded.setup}, {loaded.state}, {}, {}).staging.member_capacity);
  const auto hasty = gpu::make_host_backend(1, tiny);
  State at_the_cut = loaded.state;
  at_the_cut.frame = kPauses;
  hasty->load({loaded.setup}, {at_the_cut});
  EXPECT_THROW(hasty->run({Stage::step, Stage::skin}), MachineError);
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
}  // namespace cutproof::property_tests::histories_test
