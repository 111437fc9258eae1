// What let wrong states through once: each recording here is wrong in one place, and is rejected there.
#include "harness/scene_judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include "reference_cpu/reference.h"
#include "tests/cut_scene.h"
#include "tests/harness/recorded_scene.h"

namespace cutproof::scene_judge_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsSubsetOf;
using ::testing::IsSupersetOf;
using ::testing::UnorderedElementsAre;
using tests::failing;
using tests::RecordedScene;

// Two clusters that overlap; nothing touches the body, and nobody looks for cuts.
constexpr const char* kFallingScene = R"({"version": 5, "name": "falling",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.04, 0.04]}, "spacing": 0.01}, "clusters": {"side": 4},
  "frame": {"count": 4}, "step": {"acceleration": "none", "gravity": [0, 0, -9.81], "damping": 2}})";

class WrongRecording : public testing::Test {
 protected:
  const std::unique_ptr<Backend> reference_ = reference::make_backend();
};

// What no moment is asked is asked once of each run.
TEST_F(WrongRecording, IsAskedWhatAnyRunIsAsked) {
  std::map<std::string, int> asked;
  for (const char* json : {tests::kCutScene, kFallingScene}) {
    RecordedScene recorded(json, *reference_);
    const auto judge = recorded.judged();
    for (const Verdict& verdict : judge->verdicts()) ++asked[verdict.property];
  }
  for (const char* const once : {"what is gone stays gone", "no coupling across pieces", "centre of mass"}) {
    EXPECT_EQ(asked[once], 2) << once;
  }
  for (const char* const never : {"run well formed", "no teleport"}) EXPECT_EQ(asked[never], 0) << never;
}

TEST_F(WrongRecording, IsNotAnUntouchedOneWhicheverSnapshotsItHas) {
  for (const char* json : {tests::kCutScene, kFallingScene}) {
    RecordedScene recorded(json, *reference_);
    EXPECT_THAT(failing(*recorded.judged()), IsEmpty());
    recorded.keep_ends_of_frames();
    EXPECT_THAT(failing(*recorded.judged()), IsEmpty()) << "ends of frames alone";
  }
}

// --- Between the last stage and the end of the frame -----------------------------------------------------------------

TEST_F(WrongRecording, WithNumbersThatAreNotCompactAtTheEndOfAFrame) {
  for (const bool cutting : {false, true}) {
    for (const bool ends_only : {false, true}) {
      RecordedScene recorded(tests::kCutScene, *reference_);
      if (ends_only) recorded.keep_ends_of_frames();
      recorded.first(Stage::skin, cutting).clusters.number.back() += 1;
      EXPECT_THAT(failing(*recorded.judged()), Contains("untouched")) << cutting << ends_only;
    }
  }
}

TEST_F(WrongRecording, WithVelocitiesExchangedAfterTheStep) {
  for (const bool cutting : {false, true}) {
    RecordedScene recorded(tests::kCutScene, *reference_);
    State& end = recorded.first(Stage::skin, cutting);
    end.v[0] = {1, 0, 0};
    std::swap(end.v[0], end.v[1]);
    EXPECT_THAT(failing(*recorded.judged()), Contains("untouched")) << cutting;
  }
}

TEST_F(WrongRecording, WithTheImpulseChangedAfterTheStep) {
  RecordedScene recorded(tests::kCutScene, *reference_);
  recorded.first(Stage::skin, true).impulse.x += 1e-9;
  EXPECT_THAT(failing(*recorded.judged()), Contains("untouched"));
}

TEST_F(WrongRecording, WithADegenerateFlagChangedAfterTheStep) {
  RecordedScene recorded(tests::kCutScene, *reference_);
  recorded.first(Stage::skin, true).clusters.degenerate.front() ^= 1;
  EXPECT_THAT(failing(*recorded.judged()), Contains("untouched"));
}

// A cluster takes in a neighbour of its members; its rest frame and all others are right for it.
void take_in_a_neighbour(const Setup& setup, State& state) {
  Clusters& clusters = state.clusters;
  for (const int32_t i : clusters.of(0)) {
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = setup.body.neighbour(i, direction);
      const auto members = clusters.of(0);
      if (other < 0 || state.alive[static_cast<std::size_t>(other)] == 0) continue;
      if (std::find(members.begin(), members.end(), other) != members.end()) continue;
      const auto place = std::lower_bound(members.begin(), members.end(), other) - members.begin();
      clusters.members.insert(clusters.members.begin() + place, other);
      for (std::size_t c = 1; c < clusters.offsets.size(); ++c) ++clusters.offsets[c];
      reference::update_rest_frames(setup.body, clusters);
      return;
    }
  }
  FAIL() << "no cluster has a neighbour";
}

TEST_F(WrongRecording, InWhichAClusterGrowsAfterExpansion) {
  RecordedScene recorded(kFallingScene, *reference_);
  const auto at = recorded.snapshots.size() - 1;
  ASSERT_EQ(recorded.snapshots[at].stage, Stage::skin);
  take_in_a_neighbour(recorded.built.setup, recorded.snapshots[at].state);
  EXPECT_THAT(failing(*recorded.judged()), Contains("untouched"));
}

// --- Where no detection is launched ----------------------------------------------------------------------------------

TEST_F(WrongRecording, InWhichAParticleDiesUnlistedWhereNothingDetects) {
  for (const bool ends_only : {false, true}) {
    RecordedScene recorded(kFallingScene, *reference_);
    if (ends_only) recorded.keep_ends_of_frames();
    for (std::size_t k = recorded.snapshots.size() / 2; k < recorded.snapshots.size(); ++k) {
      recorded.snapshots[k].state.alive[5] = 0;
    }
    EXPECT_THAT(failing(*recorded.judged()), Contains("untouched")) << ends_only;
  }
}

TEST_F(WrongRecording, InWhichAClusterGrowsWhereNothingDetects) {
  RecordedScene recorded(kFallingScene, *reference_);
  recorded.keep_ends_of_frames();
  for (std::size_t k = 2; k < recorded.snapshots.size(); ++k) {
    take_in_a_neighbour(recorded.built.setup, recorded.snapshots[k].state);
  }
  EXPECT_THAT(failing(*recorded.judged()), Contains("untouched"));
}

// --- Frames ----------------------------------------------------------------------------------------------------------

TEST_F(WrongRecording, WithAWrongFrameNumberInItsLastSnapshot) {
  RecordedScene recorded(tests::kCutScene, *reference_);
  recorded.snapshots.back().state.frame += 1;
  EXPECT_THAT(failing(*recorded.judged()), ElementsAre("a frame ends with skin and nowhere else"));
}

TEST_F(WrongRecording, WithoutItsLastFrames) {
  RecordedScene recorded(kFallingScene, *reference_);
  recorded.keep_ends_of_frames();
  recorded.snapshots.pop_back();
  const auto judge = recorded.judged();
  EXPECT_THAT(failing(*judge), ElementsAre("the run is whole"));
  EXPECT_EQ(judge->verdicts().back().property, "something was judged");
}

TEST_F(WrongRecording, WithSnapshotsInAnotherOrder) {
  RecordedScene recorded(kFallingScene, *reference_);
  ASSERT_EQ(recorded.snapshots[1].stage, Stage::step);
  std::swap(recorded.snapshots[1], recorded.snapshots[2]);
  EXPECT_THAT(failing(*recorded.judged()), Contains("snapshots come in the order of stages"));
}

TEST_F(WrongRecording, WithAMalformedSnapshotFailsThereAndNowhereElse) {
  RecordedScene recorded(kFallingScene, *reference_);
  recorded.keep_ends_of_frames();
  State& broken = recorded.snapshots[2].state;  // of frame 1
  broken.clusters.members[0] = 1'000'000;
  const auto judge = recorded.judged();
  EXPECT_THAT(failing(*judge), ElementsAre("well formed"));
  for (const Verdict& verdict : judge->verdicts()) {
    if (verdict.holds) continue;
    EXPECT_EQ(verdict.frame, 1);
  }
  int64_t last = 0;
  for (const Verdict& verdict : judge->verdicts()) last = std::max(last, verdict.frame);
  EXPECT_EQ(last, recorded.built.setup.frame_count() - 1) << "frames are counted on";
}

TEST_F(WrongRecording, WithoutExpectationsIsSaidToHaveNone) {
  RecordedScene recorded(tests::kCutScene, *reference_);
  EXPECT_THAT(recorded.judged()->notes(), IsEmpty());
  recorded.scene.expect = {};
  const auto notes = recorded.judged()->notes();
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("has no expectations"), std::string::npos) << notes[0];
}

TEST_F(WrongRecording, WhoseShellsCannotBeCountedIsSaidToHaveThem) {
  RecordedScene recorded(tests::kCutScene, *reference_);
  auto& triangles = recorded.snapshots.back().state.skin.triangles;
  triangles.push_back(triangles.front());
  const auto judge = recorded.judged();
  for (const Verdict& verdict : judge->verdicts()) {
    if (verdict.holds) continue;
    EXPECT_EQ(verdict.witness.text.find("counts -"), std::string::npos) << verdict.witness.text;
    if (verdict.property != "expected shells at the end") continue;
    EXPECT_NE(verdict.witness.text.find("cannot be counted"), std::string::npos) << verdict.witness.text;
  }
  EXPECT_THAT(failing(*judge), Contains("expected shells at the end"));
}

// --- What links a frame to the next ----------------------------------------------------------------------------------

void one_substep(Setup& setup, State&) {
  setup.step.substeps = 1;
  setup.blade_moves.clear();
}

void unchanged(Setup&, State&) {}

void shift(State& state, Vec3 by) {
  for (Vec3& x : state.x) x += by;
  for (Vec3& x : state.skin.position) x += by;
}

// The least shifts that are found, and what is still within rounding: what a judge cannot tell apart it must not.
TEST_F(WrongRecording, WhoseBodyAndSkinAreShiftedInOneFrame) {
  for (const double by : {1.0, 1e-3, 1e-9}) {
    for (const bool single : {false, true}) {
      RecordedScene recorded(kFallingScene, *reference_, single ? one_substep : unchanged);
      recorded.keep_ends_of_frames();
      for (std::size_t k = 2; k < recorded.snapshots.size(); ++k) shift(recorded.snapshots[k].state, {by, 0, 0});
      EXPECT_THAT(failing(*recorded.judged()), AllOf(IsSupersetOf({"motion", "admissible step"}),
                                                     IsSubsetOf({"motion", "admissible step", "centre of mass"})))
          << by << " m, " << single;
    }
  }
  RecordedScene recorded(kFallingScene, *reference_);
  recorded.keep_ends_of_frames();
  for (std::size_t k = 2; k < recorded.snapshots.size(); ++k) shift(recorded.snapshots[k].state, {1e-17, 0, 0});
  EXPECT_THAT(failing(*recorded.judged()), IsEmpty());
}

TEST_F(WrongRecording, WhoseVelocitiesAreNotThoseOfItsPositions) {
  for (const double by : {100.0, 1e-9}) {
    RecordedScene recorded(kFallingScene, *reference_, one_substep);
    recorded.keep_ends_of_frames();
    State& last = recorded.snapshots.back().state;
    for (std::size_t i = 0; i < last.v.size(); ++i) last.v[i].x += i % 2 == 0 ? by : -by;
    EXPECT_THAT(failing(*recorded.judged()), UnorderedElementsAre("motion", "admissible step"))
        << by << " m/s, in sum none";
  }
}

TEST_F(WrongRecording, InWhichAGripDoesNotHoldWhatItHolds) {
  constexpr const char* kPulled = R"({"version": 5, "name": "pulled",
    "body": {"shape": {"kind": "box", "size": [0.08, 0.02, 0.02]}, "spacing": 0.01}, "clusters": {"side": 4},
    "frame": {"count": 4}, "step": {"acceleration": "none"}, "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1]},
      {"low": [0.8, 0, 0], "high": [1, 1, 1], "velocity": [0.1, 0, 0]}]})";
  RecordedScene right(kPulled, *reference_);
  EXPECT_THAT(failing(*right.judged()), IsEmpty());
  RecordedScene shifted(kPulled, *reference_);
  shifted.keep_ends_of_frames();
  for (std::size_t k = 2; k < shifted.snapshots.size(); ++k) shift(shifted.snapshots[k].state, {0, 1, 0});
  EXPECT_THAT(failing(*shifted.judged()), UnorderedElementsAre("motion", "admissible step"));
}

// On a wall that pushes to one side only: by more than the impulse can do at its earliest (2.5 mm here), or by less
// than at its latest (0.6 mm); it does about 1 to 1.6 mm, so a shift of less than that cannot be told without running
// the step.
TEST_F(WrongRecording, InWhichTheGroundPushesFartherThanItsImpulse) {
  constexpr const char* kStanding = R"({"version": 5, "name": "standing",
    "body": {"shape": {"kind": "box", "size": [0.04, 0.02, 0.02]}, "spacing": 0.01}, "frame": {"count": 4},
    "step": {"acceleration": "none", "gravity": [0, 0, -9.81]}, "ground": {"friction": 0}})";
  RecordedScene right(kStanding, *reference_);
  EXPECT_THAT(failing(*right.judged()), IsEmpty());
  for (const double by : {2e-3, -1e-3}) {
    RecordedScene shifted(kStanding, *reference_);
    shifted.keep_ends_of_frames();
    for (std::size_t k = 2; k < shifted.snapshots.size(); ++k) shift(shifted.snapshots[k].state, {0, 0, by});
    EXPECT_THAT(failing(*shifted.judged()), Contains("motion")) << by;
  }
}

// From about 1e160 on squares overflow, and an infinite distance is within an infinite bound.
TEST_F(WrongRecording, WhosePositionsOrVelocitiesAreSoLargeThatNoBoundIsFinite) {
  for (const double huge : {1e150, 1e160, 1e300}) {
    for (const bool positions : {true, false}) {
      RecordedScene recorded(kFallingScene, *reference_);
      recorded.keep_ends_of_frames();
      for (Vec3& v : positions ? recorded.snapshots.back().state.x : recorded.snapshots.back().state.v) {
        v = {huge, huge, huge};
      }
      const auto judge = recorded.judged();
      EXPECT_FALSE(judge->holds()) << huge;
      for (const Verdict& verdict : judge->verdicts()) {
        EXPECT_TRUE(!verdict.holds || (std::isfinite(verdict.measured) && std::isfinite(verdict.bound)))
            << verdict.property << " of " << huge;
      }
    }
  }
}

// --- What verdicts came to -------------------------------------------------------------------------------------------

TEST_F(WrongRecording, IsSummedUpByPropertyAndStage) {
  RecordedScene recorded(kFallingScene, *reference_);
  const auto judge = recorded.judged();
  const harness::PropertySummary* const motion = judge->summaries().find("motion", Stage::step);
  ASSERT_NE(motion, nullptr);
  int64_t judged = 0, checked = 0;
  double measured = 0, of_bound = 0;
  for (const Verdict& verdict : judge->verdicts()) {
    if (verdict.property != "motion") continue;
    ++judged;
    checked += verdict.checked;
    measured = std::max(measured, verdict.measured);
    of_bound = std::max(of_bound, verdict.measured / verdict.bound);
  }
  EXPECT_EQ(motion->judged, judged);
  EXPECT_EQ(motion->checked, checked);
  EXPECT_EQ(motion->failed, 0);
  EXPECT_EQ(motion->measured, measured);
  EXPECT_EQ(motion->of_bound, of_bound);
  EXPECT_GT(of_bound, 0);
  EXPECT_LT(of_bound, 1);
  // What is counted has no bound but 0, and what is held against the run as a whole is no property.
  ASSERT_NE(judge->summaries().find("coverage", Stage::skin), nullptr);
  EXPECT_FALSE(judge->summaries().find("coverage", Stage::skin)->of_bound.has_value());
  EXPECT_EQ(judge->summaries().find("the run is whole", Stage::skin), nullptr);

  recorded.keep_ends_of_frames();
  shift(recorded.snapshots.back().state, {1, 0, 0});
  const auto wrong = recorded.judged();
  EXPECT_EQ(wrong->summaries().find("motion", Stage::step)->failed, 1);
  EXPECT_GT(wrong->summaries().find("motion", Stage::step)->of_bound, 1);
}

TEST(PropertySummaries, JoinAsIfAllHadBeenAddedToOne) {
  const auto verdict = [](double measured, double bound, int64_t checked) {
    Verdict one;
    one.property = "a";
    one.measured = measured;
    one.bound = bound;
    one.checked = checked;
    one.took.seconds = 0.25;
    return one;
  };
  const Verdict all[] = {verdict(1, 10, 3), verdict(4, 100, 1), verdict(7, 0, 2), verdict(9, 9, 0)};
  harness::PropertySummaries one, first, second;
  for (int k = 0; k < 4; ++k) {
    one.add(all[k]);
    (k < 1 ? first : second).add(all[k]);
  }
  second.join(first);
  for (const harness::PropertySummaries* summaries : {&one, &second}) {
    ASSERT_EQ(summaries->all().size(), 1u);
    const harness::PropertySummary& a = summaries->all().front();
    EXPECT_EQ(a.judged, 3);
    EXPECT_EQ(a.checked, 6);
    EXPECT_EQ(a.measured, 7) << "the one that looked at nothing does not count";
    EXPECT_EQ(a.of_bound, 0.1) << "of the least bound, not of the greatest measure";
    EXPECT_EQ(a.seconds, 4 * 0.25);
  }
}

// What is no number is the worst, whatever comes after it; and what fails counts as judged though it looked at nothing.
TEST(PropertySummaries, KeepWhatIsNoNumberAndWhatCouldNotBeJudged) {
  Verdict one;
  one.property = "a";
  one.bound = 1;
  one.checked = 1;
  one.holds = false;
  harness::PropertySummaries first, second;
  for (const double measured : {1.0, std::nan(""), 2.0}) {
    one.measured = measured;
    first.add(one);
  }
  EXPECT_TRUE(std::isnan(first.all().front().measured));
  second.add(one);
  second.join(first);
  EXPECT_TRUE(std::isnan(second.all().front().measured));
  one.checked = 0;
  second.add(one);
  EXPECT_EQ(second.all().front().judged, 5);
  EXPECT_EQ(second.all().front().failed, 5);
  EXPECT_EQ(second.all().front().checked, 4);
}

// --- Depth -----------------------------------------------------------------------------------------------------------

TEST_F(WrongRecording, IsSaidToHaveOnlyItsTopologyJudged) {
  const RecordedScene recorded(tests::kCutScene, *reference_);
  for (const harness::Depth depth : {harness::Depth::topology, harness::Depth::motion}) {
    harness::SceneJudge judge(recorded.built.setup, recorded.scene.expect, "a backend", recorded.trace.initial, depth);
    for (const harness::Moment& moment : recorded.trace.moments) judge.see(moment);
    judge.finish();
    EXPECT_TRUE(judge.holds());
    const auto notes = judge.notes();
    const bool said = std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
      return note.find("Only the topology") != std::string::npos;
    });
    EXPECT_EQ(said, depth == harness::Depth::topology);
    EXPECT_EQ(harness::depth_named(name_of(depth)), depth);
  }
  EXPECT_EQ(harness::depth_named("everything"), std::nullopt);
}

// --- The whole run ---------------------------------------------------------------------------------------------------

TEST_F(WrongRecording, FailsWhereAPropertyLookedAtNothingAndDoesNotSayWhy) {
  const RecordedScene recorded(tests::kCutScene, *reference_);
  const auto failing_with = [&](int64_t checked, const std::string& vacuous) {
    harness::SceneJudge judge(recorded.built.setup, recorded.scene.expect, "a backend", recorded.trace.initial);
    for (const harness::Moment& moment : recorded.trace.moments) judge.see(moment);
    Verdict verdict;
    verdict.property = "a property";
    verdict.checked = checked;
    verdict.vacuous = vacuous;
    for (int frame = 0; frame < 2; ++frame) judge.add(verdict);
    judge.finish();
    EXPECT_EQ(judge.holds(), failing(judge).empty());
    return failing(judge);
  };
  EXPECT_THAT(failing_with(0, ""), ElementsAre("every property looked at something"));
  EXPECT_THAT(failing_with(0, "no blade"), IsEmpty());
  EXPECT_THAT(failing_with(1, ""), IsEmpty());
}

// CGAL's checks of the skin cost more than a frame: they are made of the first skin, and after every cut.
TEST_F(WrongRecording, HasItsSkinJudgedThoroughlyAtFirstAndAfterEveryCut) {
  constexpr const char* kTwoStrokes = R"({"version": 5, "name": "two strokes",
    "body": {"shape": {"kind": "box", "size": [0.06, 0.02, 0.02]}, "spacing": 0.01},
    "frame": {"settle": 0.032}, "step": {"acceleration": "none"}, "detect": {"criterion": "geometric"},
    "blade": {"speed": 2, "strokes": [{"points": [[0.3, 0.5, 5], [0.3, 0.5, -1]], "along": [0, 1, 0]},
      {"points": [[0.7, 0.5, 2], [0.7, 0.5, -1]], "along": [0, 1, 0]}]}})";
  const RecordedScene recorded(kTwoStrokes, *reference_);
  std::set<int64_t> cuts, others;
  for (const harness::Moment& moment : recorded.trace.moments) {
    if (moment.span.last != Stage::skin) continue;
    (moment.after->removed.empty() ? others : cuts).insert(moment.before->frame);
  }
  ASSERT_GE(cuts.size(), 2u);
  ASSERT_GE(others.size(), 2u);
  ASSERT_TRUE(others.contains(0));
  std::set<int64_t> expected = cuts;
  expected.insert(0);
  harness::SceneJudge judge(recorded.built.setup, recorded.scene.expect, "a backend", recorded.trace.initial);
  for (const harness::Moment& moment : recorded.trace.moments) judge.see(moment);
  judge.finish();
  std::map<std::string, std::set<int64_t>> judged;
  for (const Verdict& verdict : judge.verdicts()) {
    if (verdict.checked > 0) judged[verdict.property].insert(verdict.frame);
  }
  EXPECT_EQ(judged.at("skin geometry"), expected);
  EXPECT_EQ(judged.at("skin shells"), expected);
  EXPECT_GT(judged.at("skin surface").size(), expected.size()) << "the cheap ones in every frame";

  // A hole in it after the first cut, and after the last.
  for (const int64_t frame : {*cuts.begin(), *cuts.rbegin()}) {
    RecordedScene wrong(kTwoStrokes, *reference_);
    for (io::Snapshot& snapshot : wrong.snapshots) {
      if (snapshot.stage == Stage::skin && snapshot.state.frame == frame + 1) {
        snapshot.state.skin.triangles.pop_back();
      }
    }
    EXPECT_THAT(failing(*wrong.judged()), Contains("skin geometry")) << frame;
  }
}

// --- Who did the work ------------------------------------------------------------------------------------------------

using Stages = std::vector<std::string>;

// The reference, of which some spans are offered: what an outside simulator looks like that runs whole frames alone, or
// one stage of six.
class InPart final : public Backend {
 public:
  explicit InPart(bool (*offers)(Span)) : offers_(offers) {}

  std::string name() const override { return "in part"; }
  Precision precision() const override { return inner_->precision(); }
  bool can_run(Span span) const override { return offers_(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    if (!can_run(span)) throw std::logic_error("A span was run that is not offered.");
    inner_->run(span);
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  bool (*offers_)(Span);
};
std::unique_ptr<Backend> only(bool (*can_run)(Span)) { return std::make_unique<InPart>(can_run); }
constexpr bool nothing(Span) { return false; }
template <Stage stage>
constexpr bool alone(Span span) {
  return span == Span{stage, stage};
}

std::unique_ptr<harness::SceneJudge> judged_live(const RecordedScene& recorded) {
  auto judge = std::make_unique<harness::SceneJudge>(recorded.built.setup, recorded.scene.expect, "a backend",
                                                     recorded.trace.initial);
  for (const harness::Moment& moment : recorded.trace.moments) judge->see(moment);
  judge->finish();
  return judge;
}

TEST(WhoDidTheWork, IsNobodyWhereTheBackendRunsNothingAndThenTheRunFails) {
  RecordedScene recorded(tests::kCutScene, *only(nothing));
  const auto live = judged_live(recorded), from_files = recorded.judged();
  for (const harness::SceneJudge* judge : {live.get(), from_files.get()}) {
    EXPECT_FALSE(judge->holds());
    EXPECT_THAT(failing(*judge), ElementsAre("something was judged"));
    EXPECT_THAT(judge->verdicts().back().witness.text, testing::HasSubstr("the backend ran no stage"));
    EXPECT_EQ(judge->left_to_reference(), (Stages{"step", "detect", "split", "merge", "skin"}));
    EXPECT_THAT(judge->not_its_own(), ElementsAre("components at the end", "shells at the end"));
    EXPECT_TRUE(judge->summaries().all().empty());
    for (const Verdict& verdict : judge->verdicts())
      EXPECT_FALSE(verdict.property.starts_with("expected")) << verdict.property;
  }
}

TEST(WhoDidTheWork, IsSaidByStageAndOnlyWhatTheBackendRanIsJudged) {
  const struct {
    bool (*can_run)(Span);
    Stages left, not_its_own;
    const char* judged;
  } all[] = {{alone<Stage::step>, {"detect", "split", "merge", "skin"}, {}, "admissible step"},
             {alone<Stage::split>,
              {"step", "detect", "merge", "skin"},
              {"components at the end", "shells at the end"},
              "split exactness"},
             {alone<Stage::skin>, {"step", "detect", "split", "merge"}, {"components at the end"}, "skin vertices"}};
  for (const auto& [can_run, left, not_its_own, judged] : all) {
    RecordedScene recorded(tests::kCutScene, *only(can_run));
    const auto live = judged_live(recorded), from_files = recorded.judged();
    for (const harness::SceneJudge* judge : {live.get(), from_files.get()}) {
      EXPECT_TRUE(judge->holds());
      EXPECT_EQ(judge->left_to_reference(), left);
      EXPECT_EQ(judge->not_its_own(), not_its_own);
      std::set<std::string> stages, properties;
      for (const harness::PropertySummary& summary : judge->summaries().all()) {
        stages.emplace(name_of(summary.stage));
        properties.insert(summary.property);
      }
      EXPECT_EQ(stages.size(), 1u) << *stages.begin();
      EXPECT_TRUE(properties.contains(judged)) << judged;
      EXPECT_THAT(judge->notes(), Contains(testing::HasSubstr("The reference ran " + left.front())));
    }
    EXPECT_EQ(live->verdicts(), from_files->verdicts()) << "a recording keeps who ran what";
  }
}

TEST(WhoDidTheWork, IsTheBackendsWhereItRunsAllAndThenNothingIsSaid) {
  RecordedScene recorded(tests::kCutScene, *reference::make_backend());
  const auto judge = recorded.judged();
  EXPECT_THAT(judge->left_to_reference(), IsEmpty());
  EXPECT_THAT(judge->not_its_own(), IsEmpty());
  EXPECT_THAT(judge->notes(), IsEmpty());
}

// Whoever records the ends of frames alone and says that a stage was not its own has shown nothing of its own.
TEST(WhoDidTheWork, CannotBeToldOfARecordingOfEndsOfFramesInWhichAStageWasLeft) {
  RecordedScene recorded(tests::kCutScene, *only(alone<Stage::skin>));
  recorded.keep_ends_of_frames();
  EXPECT_THAT(failing(*recorded.judged()), ElementsAre("something was judged"));
}

// --- Nothing to judge ------------------------------------------------------------------------------------------------

TEST_F(WrongRecording, OfABodyWithoutParticlesOrOfNoFramesJudgesNothingAndFails) {
  RecordedScene recorded(kFallingScene, *reference_);
  recorded.snapshots.resize(1);
  recorded.built.setup.substep_length.clear();
  EXPECT_THAT(failing(*recorded.judged()), ElementsAre("something was judged"));

  cutproof::Setup empty;
  empty.body.grid = {{2, 2, 2}, 0.01};
  empty.body.particle_at.assign(8, -1);
  empty.substep_length = {0.004};
  empty.skin.wanted = false;
  const auto before = std::make_shared<const State>();
  State after;
  after.frame = 1;
  harness::SceneJudge judge(empty, {}, "a backend", before);
  judge.see({0, {}, before, std::make_shared<const State>(after), true});
  judge.finish();
  EXPECT_FALSE(judge.holds());
}

}  // namespace
}  // namespace cutproof::scene_judge_test
