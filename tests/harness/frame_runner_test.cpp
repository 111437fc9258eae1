// Backends that can run some spans only are run, and judged on what they run.
#include "harness/frame_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "model/io/atomic_file.h"
#include "property_tests/campaign.h"
#include "property_tests/campaign_report.h"
#include "reference_cpu/reference.h"
#include "tests/cut_scene.h"
#include "tests/harness/recorded_scene.h"

namespace cutproof::frame_runner_test {
namespace {

using harness::plan_spans;
using harness::PlannedSpan;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using tests::failing;

// The reference, but for what it can run, and what goes wrong in it.
class Partial final : public Backend {
 public:
  using Can = std::function<bool(Span)>;
  using Fault = std::function<void(Span, State&)>;
  explicit Partial(Can can, Fault fault = {}) : can_(std::move(can)), fault_(std::move(fault)) {}

  std::string name() const override { return "partial"; }
  bool can_run(Span span) const override { return can_(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    EXPECT_TRUE(can_(span)) << "asked to run " << name_of(span.first) << " to " << name_of(span.last);
    inner_->run(span);
    report_ = inner_->report();
    if (!fault_) return;
    std::vector<State> states = inner_->snapshot();
    for (State& state : states) fault_(span, state);
    inner_->load(setups_, std::move(states));
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  Can can_;
  Fault fault_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  std::vector<Setup> setups_;
  SpanReport report_;
};

bool whole_frames_only(Span span) { return span == Span{}; }
bool split_only(Span span) { return span == Span{Stage::split, Stage::split}; }
bool step_and_the_rest(Span span) {
  return span == Span{Stage::step, Stage::step} || span == Span{Stage::detect, Stage::skin};
}

std::unique_ptr<harness::SceneJudge> judged_live(Backend& backend, const std::string& json) {
  static std::vector<std::unique_ptr<fixtures::Built>> kept;  // judges refer to their setups
  const Scene scene = io::parse_scene(json, "the test's scene");
  kept.push_back(std::make_unique<fixtures::Built>(fixtures::build(scene, "the test's scene")));
  const fixtures::Built& built = *kept.back();
  harness::FrameRunner runner(backend, {built.setup}, {built.state});
  auto judge =
      std::make_unique<harness::SceneJudge>(built.setup, scene.expect, backend.name(), runner.states().front());
  while (!runner.is_over()) runner.run_frame([&](const harness::Moment& moment) { judge->see(moment); });
  for (Verdict& verdict : runner.take_broken_contracts()) judge->add(std::move(verdict));
  judge->finish();
  return judge;
}

TEST(Plan, GivesTheBackendAsManyStagesAsItCanRun) {
  const Partial whole(whole_frames_only), split(split_only), two(step_and_the_rest), all([](Span) { return true; }),
      none([](Span) { return false; });
  EXPECT_THAT(plan_spans(whole, {}, true), ElementsAre(PlannedSpan{{}, true}));
  const auto of_split = plan_spans(split, {}, true);
  ASSERT_EQ(of_split.size(), 6u);
  for (const PlannedSpan& piece : of_split) EXPECT_EQ(piece.by_backend, piece.span.first == Stage::split);
  EXPECT_THAT(plan_spans(two, {}, true), ElementsAre(PlannedSpan{{Stage::step, Stage::step}, true},
                                                     PlannedSpan{{Stage::detect, Stage::skin}, true}));
  EXPECT_EQ(plan_spans(all, {}, true).size(), 6u);
  EXPECT_THAT(plan_spans(all, {}, false), ElementsAre(PlannedSpan{{}, true}));
  for (const PlannedSpan& piece : plan_spans(none, {}, true)) EXPECT_FALSE(piece.by_backend);
}

TEST(PartialBackend, ThatRunsWholeFramesOnlyIsJudged) {
  Partial right(whole_frames_only);
  const auto judge = judged_live(right, tests::kCutScene);
  EXPECT_THAT(failing(*judge), IsEmpty());
  EXPECT_GT(judge->verdicts().size(), 50u);
}

// A particle goes over from one cluster of the result to another: what is left is connected, covered and small enough,
// so only the reference's answer to the same removal shows it.
TEST(PartialBackend, ThatRunsWholeFramesOnlyIsFoundWrong) {
  Partial wrong(whole_frames_only, [](Span, State& state) {
    if (!state.removed.empty()) state.clusters.rotation.front().m = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  });
  EXPECT_FALSE(judged_live(wrong, tests::kCutScene)->holds());
  Partial keeps_a_cluster(whole_frames_only, [](Span, State& state) {
    if (state.removed.empty()) return;
    std::swap(state.clusters.rest_center.front(), state.clusters.rest_center.back());
  });
  EXPECT_FALSE(judged_live(keeps_a_cluster, tests::kCutScene)->holds());
  Partial revives(whole_frames_only, [](Span, State& state) {
    if (!state.removed.empty()) state.removed.pop_back();
  });
  EXPECT_THAT(failing(*judged_live(revives, tests::kCutScene)), Contains("detection"));
}

TEST(PartialBackend, ThatRunsOnlySplitIsJudgedOnThatAlone) {
  Partial right(split_only);
  const auto judge = judged_live(right, tests::kCutScene);
  bool split_judged = false;
  for (const Verdict& verdict : judge->verdicts()) {
    split_judged = split_judged || verdict.property == "split exactness";
    EXPECT_NE(verdict.property, "linear momentum") << "the reference's step is not judged";
  }
  EXPECT_TRUE(split_judged);
  EXPECT_THAT(failing(*judge), IsEmpty());
}

// Without anybody who looks on there are no states of what lies between.
TEST(PartialBackend, KeepsItsContractWhetherOrNotSomebodyLooksOn) {
  const Scene scene = io::parse_scene(tests::kCutScene, "the test's scene");
  const fixtures::Built built = fixtures::build(scene, "the test's scene");
  for (const bool seen : {true, false}) {
    Partial right(split_only);
    harness::FrameRunner runner(right, {built.setup}, {built.state});
    const harness::Observer look = [](const harness::Moment&) {};
    while (!runner.is_over()) runner.run_frame(seen ? look : nullptr);
    EXPECT_THAT(runner.take_broken_contracts(), IsEmpty()) << seen;
  }
}

TEST(PartialBackend, ThatRunsOnlySplitIsFoundWrong) {
  Partial wrong(split_only, [](Span, State& state) {
    if (state.clusters.count() > 1) std::swap(state.clusters.rotation.front(), state.clusters.rotation.back());
    if (state.clusters.count() > 1) state.clusters.rotation.front().m[0] += 1e-9;
  });
  EXPECT_THAT(failing(*judged_live(wrong, tests::kCutScene)), Contains("split exactness"));
}

// What it is handed in the middle of a frame it must begin with: else it would be judged on a state of its own making.
TEST(PartialBackend, ThatLoadsSomethingElseIsFoundWrong) {
  class Forgetful final : public Backend {
   public:
    std::string name() const override { return "forgetful"; }
    bool can_run(Span span) const override { return split_only(span); }
    void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
      for (State& state : states) state.tau += 1;
      inner_->load(std::move(setups), std::move(states));
    }
    void run(Span span) override { inner_->run(span); }
    std::vector<State> snapshot() const override { return inner_->snapshot(); }
    SpanReport report() const override { return inner_->report(); }

   private:
    std::unique_ptr<Backend> inner_ = reference::make_backend();
  } forgetful;
  const Scene scene = io::parse_scene(tests::kCutScene, "the test's scene");
  const fixtures::Built built = fixtures::build(scene, "the test's scene");
  harness::FrameRunner runner(forgetful, {built.setup}, {built.state});
  runner.run_frame([](const harness::Moment&) {});
  const std::vector<Verdict> broken = runner.take_broken_contracts();
  ASSERT_FALSE(broken.empty());
  EXPECT_EQ(broken.front().property, "loading changes nothing");
}

// --- By `fuzz` -------------------------------------------------------------------------------------------------------

property_tests::Campaign fuzzed(const Partial::Can& can, const Partial::Fault& fault, bool dynamics = false) {
  property_tests::CampaignOptions options;
  options.cases = dynamics ? 80 : 200;
  options.dynamics = dynamics;
  options.keep_going = true;
  return property_tests::run_campaign(
      options, {[&](int64_t, int) { return std::make_unique<Partial>(can, fault); }, false}, nullptr);
}

TEST(PartialBackend, IsJudgedByFuzzWhateverItCanRun) {
  for (const Partial::Can can : {whole_frames_only, split_only, step_and_the_rest}) {
    const property_tests::Campaign campaign = fuzzed(can, {});
    EXPECT_TRUE(campaign.violations.empty());
    EXPECT_GT(campaign.verdicts, 1000);
  }
}

TEST(PartialBackend, ThatRunsWholeFramesOfBodiesThatMoveIsJudgedByFuzz) {
  const property_tests::Campaign campaign = fuzzed(whole_frames_only, {}, true);
  for (const auto& violation : campaign.violations) {
    ADD_FAILURE() << violation.index << ": " << violation.verdict.property << ": " << violation.verdict.witness.text;
  }
  EXPECT_EQ(campaign.stages.left(), std::vector<std::string>{});
  const harness::PropertySummary* const step = campaign.properties.find("admissible step", Stage::step);
  ASSERT_NE(step, nullptr);
  EXPECT_LE(static_cast<double>(step->inconclusive), 0.01 * static_cast<double>(step->checked));
}

// A tenth of a radian, in frames that cut.
TEST(PartialBackend, ThatTurnsClustersInWholeFramesThatCutIsFoundWrongByFuzz) {
  const auto turns = [](Span, State& state) {
    if (state.removed.empty()) return;
    for (Mat3& r : state.clusters.rotation) {
      const Mat3 was = r;
      for (int column = 0; column < 3; ++column) {
        r(0, column) = std::cos(0.1) * was(0, column) - std::sin(0.1) * was(1, column);
        r(1, column) = std::sin(0.1) * was(0, column) + std::cos(0.1) * was(1, column);
      }
    }
  };
  const property_tests::Campaign campaign = fuzzed(whole_frames_only, turns, true);
  EXPECT_GT(campaign.violations.size(), 10u);
  EXPECT_GT(std::count_if(campaign.violations.begin(), campaign.violations.end(),
                          [](const auto& violation) { return violation.verdict.property == "admissible step"; }),
            10);
}

// --- Who ran what, of a campaign -------------------------------------------------------------------------------------

TEST(PartialBackend, IsSaidByFuzzToHaveLeftStagesToTheReference) {
  const harness::BackendChoice choice;
  const auto document = [&](const Partial::Can& can, int64_t shard) {
    property_tests::CampaignOptions options;
    options.cases = 60;
    options.shards = 2;
    options.shard = shard;
    const property_tests::Campaign campaign = property_tests::run_campaign(
        options, {[&](int64_t, int) { return std::make_unique<Partial>(can); }, false}, nullptr);
    return property_tests::campaign_document(choice, options, campaign, nlohmann::json::array());
  };
  using Stages = std::vector<std::string>;
  const nlohmann::json split = document(split_only, 0), nothing = document([](Span) { return false; }, 0);
  EXPECT_EQ(split.at("left_to_reference").get<Stages>(), (Stages{"step", "detect", "merge", "expand", "skin"}));
  EXPECT_EQ(property_tests::conclude(split, false).failure, "");
  EXPECT_EQ(nothing.at("left_to_reference").get<Stages>().size(), 6u);
  EXPECT_NE(property_tests::conclude(nothing, false).failure.find("the backend ran no stage"), std::string::npos);
  EXPECT_EQ(document([](Span) { return true; }, 0).at("left_to_reference").get<Stages>(), Stages{});

  // Of shards, all together.
  const auto folder = std::filesystem::temp_directory_path() / ("cutproof.left." + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::vector<std::string> files;
  for (const int64_t shard : {0, 1}) {
    nlohmann::json one = document(split_only, shard);
    one["left_to_reference"] = shard == 0 ? Stages{"skin"} : Stages{"step", "skin"};
    files.push_back((folder / (std::to_string(shard) + ".json")).string());
    io::write_text(files.back(), one.dump());
  }
  const nlohmann::json whole = property_tests::merge_shards(files);
  std::filesystem::remove_all(folder);
  EXPECT_EQ(whole.at("left_to_reference").get<Stages>(), (Stages{"step", "skin"}));
}

TEST(PartialBackend, IsFoundWrongByFuzzWhateverItCanRun) {
  const auto forgets_a_member = [](Span span, State& state) {
    if (!span.contains(Stage::split) || state.removed.empty() || state.clusters.count() == 0) return;
    const auto last = state.clusters.count() - 1;
    if (state.clusters.size(last) < 2) return;
    state.clusters.members.pop_back();
    --state.clusters.offsets.back();
  };
  for (const Partial::Can can : {whole_frames_only, split_only, step_and_the_rest}) {
    EXPECT_FALSE(fuzzed(can, forgets_a_member).violations.empty());
  }
}

// Merges by another rule: every answer is legal and maximal, and so nothing that an oracle could reject, but it is not
// the one that the rule of the scene leaves.
class MergesByAnotherRule final : public Backend {
 public:
  std::string name() const override { return "another rule"; }
  bool can_run(Span span) const override { return span.first == span.last; }
  void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
    for (cutproof::Setup& setup : setups) {
      if (setup.merge.rule == MergeRule::deterministic) setup.merge.rule = MergeRule::published;
    }
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override { inner_->run(span); }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
};

TEST(Dissection, ComparesMergesWithTheReference) {
  property_tests::CampaignOptions options;
  options.cases = 400;
  options.keep_going = true;
  const property_tests::Campaign campaign = property_tests::run_campaign(
      options, {[](int64_t, int) { return std::make_unique<MergesByAnotherRule>(); }, false}, nullptr);
  EXPECT_FALSE(campaign.violations.empty());
  for (const auto& violation : campaign.violations) {
    EXPECT_EQ(violation.verdict.property, "the reference's topology") << violation.verdict.witness.text;
    EXPECT_EQ(violation.verdict.stage, Stage::merge);
  }
}

}  // namespace
}  // namespace cutproof::frame_runner_test
