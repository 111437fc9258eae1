// Each field of model/fields.h changed alone, after each stage, in every comparison: each must say so. The fields are
// those of the list, so that one that is new is asked of here, and a comparison that has forgotten it fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "harness/frame_runner.h"
#include "harness/free_running.h"
#include "harness/lockstep.h"
#include "harness/reference_stages.h"
#include "model/at.h"
#include "model/io/scene_io.h"
#include "oracles/comparison/stage_comparison.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/corruptions.h"

namespace cutproof::harness::every_field_test {
namespace {

// Every stage has something to do in it, and the ground something to push (tests/harness/judge_test.cpp).
constexpr const char* kFieldsScene = R"({"version": 5, "name": "every field",
  "body": {"shape": {"kind": "box", "size": [0.16, 0.06, 0.02]}, "spacing": 0.01},
  "clusters": {"side": 2},
  "frame": {"settle": 0.032}, "detect": {"criterion": "geometric"},
  "step": {"acceleration": "none", "gravity": [0, 0, -9.81]},
  "ground": {"friction": 0.5}, "split": {"debris": 2},
  "blade": {"speed": 0.5, "strokes": [{"points": [[0.5, 0.5, 2.6], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

fixtures::Built built_scene() {
  fixtures::Built built = fixtures::build(io::parse_scene(kFieldsScene, "the test's scene"), "the test's scene");
  built.state.edge_covered = false;  // so that an expansion looks whether it is
  built.state.tau = 20;              // so that there is something to merge
  built.state.cap = 40;
  return built;
}

// A change far beyond rounding, by which the state stays well formed.
template <class T>
void change_well(const Field& field, T& value) {
  tests::alter(field, value);
}
void change_well(const Field& field, double& value) { value = field.name == "reach" ? 0.8 * value : 1.5 * value + 1; }
void change_well(const Field&, Vec3& value) { value.y += 0.25; }
void change_well(const Field&, Mat3& value) {
  value = Mat3{{value(1, 0), value(1, 1), value(1, 2), -value(0, 0), -value(0, 1), -value(0, 2), value(2, 0),
                value(2, 1), value(2, 2)}};
}
// One entry of a list: the first, the last, one in the middle, of particles one that is dead; of a list of particles,
// one more or one fewer.
enum class Entry { first, middle, last, dead };
constexpr std::array kEntries = {Entry::first, Entry::middle, Entry::last, Entry::dead};
template <class T>
void change_entry(const Field& field, Entry entry, const State&, T& value) {
  if (entry != Entry::dead) change_well(field, value);
}
template <class T>
void change_entry(const Field& field, Entry entry, const State& state, std::vector<T>& list) {
  if (entry == Entry::dead) {
    const auto dead = std::find(state.alive.begin(), state.alive.end(), 0);
    if (field.space != IndexSpace::particle || dead == state.alive.end()) return;
    return change_well(field, list[static_cast<std::size_t>(dead - state.alive.begin())]);
  }
  if (field.space == IndexSpace::state) return tests::alter(field, list);
  ASSERT_GE(list.size(), 3u) << field.name;
  const std::size_t ends = field.space == IndexSpace::cluster_end ? 1 : 0;  // they begin with 0
  const std::size_t which = entry == Entry::first    ? ends
                            : entry == Entry::middle ? list.size() / 2
                                                     : list.size() - 1 - ends;
  change_well(field, list[which]);
}

// The state, but for one field; nothing if it would not be well formed.
std::optional<State> with_one_field_changed(const cutproof::Setup& setup, const State& state, std::string_view name,
                                            Entry entry) {
  State other = state;
  for_each_field([&](const Field& field, auto get) {
    if (field.name == name) change_entry(field, entry, state, get(other));
  });
  if (same_bits(other, state) || !oracles::well_formed(setup, other).holds) return {};
  return other;
}

std::vector<Field> all_fields() {
  std::vector<Field> fields;
  for_each_field([&](const Field& field, auto) { fields.push_back(field); });
  return fields;
}

struct Step {
  Stage stage;
  State before, after;
  bool launched;
};

// The stages of the first frame in which each is due, and before which something has died.
std::vector<Step> a_whole_frame(const fixtures::Built& built) {
  const auto backend = reference::make_backend();
  backend->load({built.setup}, {built.state});
  for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) {
    State begin = backend->snapshot().front();
    begin.edge_covered = false;  // so that an expansion looks after a second cut, too
    backend->load({built.setup}, {begin});
    std::vector<Step> steps;
    bool all = true;
    for (const Stage stage : kStages) {
      State before = backend->snapshot().front();
      backend->run({stage, stage});
      steps.push_back({stage, std::move(before), backend->snapshot().front(), backend->report().ran[at(stage)]});
      all = all && steps.back().launched;
    }
    const std::vector<uint8_t>& alive = steps.front().before.alive;
    if (!all || std::find(alive.begin(), alive.end(), 0) == alive.end()) continue;
    EXPECT_FALSE(steps.front().before.skin.owner.empty()) << "there is no skin yet that could change";
    const Step& merge = steps[at(Stage::merge)];
    EXPECT_NE(merge.before.clusters.members, merge.after.clusters.members) << "nothing was merged";
    return steps;
  }
  ADD_FAILURE() << "no frame has all stages, after one that removes something";
  return {};
}

class EachFieldAlone : public ::testing::TestWithParam<Stage> {
 protected:
  // differs(field, changed): of each field, changed in one entry after this stage.
  template <class Visit>
  void for_each_change(const Visit& visit) {
    std::set<std::string_view> changed;
    for (const Field& field : all_fields()) {
      for (const Entry entry : kEntries) {
        const auto other = with_one_field_changed(built_.setup, step().after, field.name, entry);
        if (!other) continue;
        changed.insert(field.name);
        SCOPED_TRACE(std::string(field.name) + ", entry " + std::to_string(static_cast<int>(entry)));
        visit(field, *other);
      }
      EXPECT_TRUE(changed.contains(field.name)) << field.name << " was not changed";
      const bool dead = field.space != IndexSpace::particle ||
                        with_one_field_changed(built_.setup, step().after, field.name, Entry::dead).has_value();
      EXPECT_TRUE(dead) << field.name << " was not changed of what is dead";
    }
  }
  const Step& step() const { return steps_.at(at(GetParam())); }

  const fixtures::Built built_ = built_scene();
  const std::vector<Step> steps_ = a_whole_frame(built_);
};

bool any_fails(const std::vector<Verdict>& verdicts) {
  return std::any_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return !v.holds; });
}

TEST_P(EachFieldAlone, IsFoundByTheComparisonOfItsStage) {
  oracles::StageComparison comparison(built_.setup, reference_stages());
  const auto compared = [&](const State& after) {
    return comparison.compare(GetParam(), step().before, after, step().launched).verdicts("");
  };
  ASSERT_FALSE(any_fails(compared(step().after)));
  for_each_change([&](const Field&, const State& other) { EXPECT_TRUE(any_fails(compared(other))); });
}

TEST_P(EachFieldAlone, IsFoundInLockstep) {
  const auto compared = [&](const State* changed) {
    const State& begin = steps_.front().before;
    Lockstep lockstep(built_.setup, begin, begin, "a backend");
    for (const Step& one : steps_) {
      const bool here = one.stage == GetParam() && changed != nullptr;
      lockstep.see(one.stage, here ? *changed : one.after, one.launched);
      if (here) break;
    }
    return lockstep.verdicts();
  };
  ASSERT_FALSE(any_fails(compared(nullptr)));
  for_each_change([&](const Field&, const State& other) { EXPECT_TRUE(any_fails(compared(&other))); });
}

// Running freely only decisions and positions are compared.
TEST_P(EachFieldAlone, IsFoundRunningFreelyIfItIsADecision) {
  const auto compared = [&](const State* changed) {
    const State& begin = steps_.front().before;
    FreeRunning running(built_.setup, begin, begin, "a backend");
    for (const Step& one : steps_) {
      const bool here = one.stage == GetParam() && changed != nullptr;
      running.see(one.stage, here ? *changed : one.after);
      if (here) break;
    }
    return running.verdict();
  };
  ASSERT_TRUE(compared(nullptr).holds);
  for_each_change(
      [&](const Field& field, const State& other) { EXPECT_EQ(compared(&other).holds, !field.is_decision); });
}

INSTANTIATE_TEST_SUITE_P(After, EachFieldAlone, ::testing::ValuesIn(kStages),
                         [](const auto& stage) { return std::string(name_of(stage.param)); });

// Where the rule leaves several right answers, another one is explained; a wrong one is not, nor what no rule leaves
// open.
TEST(FreeRunning, ExplainsAnotherMergeOnlyIfItIsARightOne) {
  fixtures::Built built = built_scene();
  built.setup.merge.rule = MergeRule::published;
  const std::vector<Step> steps = a_whole_frame(built);
  const auto holds = [&](const std::function<void(const State& before, State& after)>& change) {
    const State& begin = steps.front().before;
    FreeRunning running(built.setup, begin, begin, "a backend");
    for (const Step& one : steps) {
      if (one.stage == Stage::merge) {
        State after = one.after;
        change(one.before, after);
        running.see(one.stage, after);
        EXPECT_TRUE(running.first_difference()) << "it is another";
        return running.verdict().holds;
      }
      running.see(one.stage, one.after);
    }
    return false;
  };
  const auto merged_by_another_rule = [&](const State& before, State& after) {
    cutproof::Setup other = built.setup;
    other.merge.rule = MergeRule::deterministic;
    after = before;
    reference::merge(other, after);
  };
  EXPECT_FALSE(holds([](const State& before, State& after) { after = before; })) << "what is small could merge";
  EXPECT_FALSE(holds([](const State&, State& after) { after.debris = {0}; }));
  EXPECT_TRUE(holds(merged_by_another_rule));
}

// --- The contract ----------------------------------------------------------------------------------------------------

// The reference, which says of itself that it runs split alone, and whose states are changed: those that it is given
// in the middle of a frame, or those that it shows once its schedule is over.
class Altered final : public Backend {
 public:
  enum class When { loading, over };
  Altered(When when, std::string_view field, Entry entry) : when_(when), field_(field), entry_(entry) {}
  std::string name() const override { return "altered"; }
  bool can_run(Span span) const override {
    return when_ == When::over ? span.first == span.last : span == Span{Stage::split, Stage::split};
  }
  void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    if (when_ == When::loading && loads_++ > 0) {
      for (std::size_t b = 0; b < states.size(); ++b) alter(setups[b], states[b]);
    }
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override { inner_->run(span); }
  std::vector<State> snapshot() const override {
    std::vector<State> states = inner_->snapshot();
    for (std::size_t b = 0; b < states.size() && when_ == When::over && is_over_; ++b) alter(setups_[b], states[b]);
    return states;
  }
  SpanReport report() const override { return inner_->report(); }
  void end() { is_over_ = true; }
  bool changed() const { return changed_; }

 private:
  void alter(const cutproof::Setup& setup, State& state) const {
    if (auto other = with_one_field_changed(setup, state, field_, entry_)) {
      state = std::move(*other);
      changed_ = true;
    }
  }
  When when_;
  std::string_view field_;
  Entry entry_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  std::vector<cutproof::Setup> setups_;
  int loads_ = 0;
  bool is_over_ = false;
  mutable bool changed_ = false;
};

TEST(EachFieldOfTheContract, MayNotChangeInABodyWhoseScheduleIsOver) {
  fixtures::Built built = built_scene();
  built.setup.substep_length.resize(1);
  built.setup.blade_moves.resize(static_cast<std::size_t>(built.setup.step.substeps));
  std::set<std::string_view> changed;
  for (const Field& field : all_fields()) {
    for (const Entry entry : kEntries) {
      SCOPED_TRACE(field.name);
      Altered backend(Altered::When::over, field.name, entry);
      FrameRunner runner(backend, {built.setup}, {built.state});
      while (!runner.is_over()) runner.run_frame([](const Moment&) {});
      runner.look_again();
      EXPECT_THAT(runner.take_broken_contracts(), ::testing::IsEmpty());
      backend.end();
      runner.look_again();
      const std::vector<Verdict> broken = runner.take_broken_contracts();
      if (!backend.changed()) continue;
      changed.insert(field.name);
      ASSERT_EQ(broken.size(), 1u);
      EXPECT_EQ(broken.front().property, "a body whose schedule is over stays as it is");
    }
  }
  for (const Field& field : all_fields()) EXPECT_TRUE(changed.contains(field.name)) << field.name;
}

TEST(EachFieldOfTheContract, MayNotChangeInLoading) {
  const fixtures::Built built = built_scene();
  const auto reference = reference::make_backend();  // for a frame, so that there is a skin
  reference->load({built.setup}, {built.state});
  reference->run({});
  const State begin = reference->snapshot().front();
  std::set<std::string_view> changed;
  for (const Field& field : all_fields()) {
    for (const Entry entry : kEntries) {
      SCOPED_TRACE(field.name);
      Altered backend(Altered::When::loading, field.name, entry);
      FrameRunner runner(backend, {built.setup}, {begin});
      runner.run({Stage::step, Stage::split}, [](const Moment&) {});
      const std::vector<Verdict> broken = runner.take_broken_contracts();
      if (!backend.changed()) continue;
      changed.insert(field.name);
      ASSERT_FALSE(broken.empty());
      EXPECT_EQ(broken.front().property, "loading changes nothing");
    }
  }
  for (const Field& field : all_fields()) EXPECT_TRUE(changed.contains(field.name)) << field.name;
}

// --- Which stages are due --------------------------------------------------------------------------------------------

// Says of one stage that it ran if it did not, and the other way round.
class Misreporting final : public Backend {
 public:
  explicit Misreporting(Stage stage) : stage_(stage) {}
  std::string name() const override { return "misreporting"; }
  bool can_run(Span span) const override { return span.first == span.last; }
  void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    inner_->run(span);
    report_ = inner_->report();
    if (span.contains(stage_)) report_.ran[at(stage_)] = !report_.ran[at(stage_)];
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  Stage stage_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  SpanReport report_;
};

TEST(Contract, ThatExactlyWhatIsDueRunsIsBrokenByEachStage) {
  const fixtures::Built built = built_scene();
  for (const Stage stage : kStages) {
    SCOPED_TRACE(name_of(stage));
    Misreporting backend(stage);
    FrameRunner runner(backend, {built.setup}, {built.state});
    std::vector<bool> due;  // by frame, as the reference ran it
    const auto reference = reference::make_backend();
    reference->load({built.setup}, {built.state});
    while (!runner.is_over()) {
      runner.run_frame([](const Moment&) {});
      reference->run({});
      due.push_back(reference->report().ran[at(stage)]);
    }
    const std::vector<Verdict> broken = runner.take_broken_contracts();
    ASSERT_EQ(broken.size(), due.size()) << "one in each frame";
    for (std::size_t frame = 0; frame < due.size(); ++frame) {
      EXPECT_EQ(broken[frame].property, due[frame] ? "a stage that is due runs" : "only what is due runs");
      EXPECT_EQ(broken[frame].stage, stage);
      EXPECT_EQ(broken[frame].frame, static_cast<int64_t>(frame));
    }
  }
}

TEST(Contract, WhatIsDueInASpanIsWhatTheReferenceRunsOfIt) {
  for (const bool covered : {false, true}) {
    for (const bool skin : {false, true}) {
      fixtures::Built built = built_scene();
      built.setup.skin.wanted = skin;
      if (covered) built.setup.expand.rule = ExpandRule::none;
      const auto along = reference::make_backend(), aside = reference::make_backend();
      along->load({built.setup}, {built.state});
      std::array<int, 6> ran = {};
      for (int64_t frame = 0; frame <= built.setup.frame_count(); ++frame) {  // one beyond the last
        for (const Stage first : kStages) {
          const State before = along->snapshot().front();
          for (const Stage last : kStages) {
            if (last < first) continue;
            aside->load({built.setup}, {before});
            aside->run({first, last});
            EXPECT_EQ(due_stages(built.setup, before, {first, last}, aside->snapshot().front()), aside->report().ran)
                << "frame " << frame << ", " << name_of(first) << " to " << name_of(last);
          }
          along->run({first, first});
          ran[at(first)] += along->report().ran[at(first)] ? 1 : 0;
        }
      }
      for (const Stage stage : kStages) {
        const bool never = (stage == Stage::expand && covered) || (stage == Stage::skin && !skin);
        EXPECT_EQ(ran[at(stage)] > 0, !never) << name_of(stage);
      }
    }
  }
}

}  // namespace
}  // namespace cutproof::harness::every_field_test
