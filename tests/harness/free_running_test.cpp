// A backend and the reference that run freely: the first decision that differs ends it, and rounding may explain it.
// (What both ways of comparing find of one deviation stands in lockstep_test.cpp.)
#include "harness/free_running.h"

#include <gtest/gtest.h>

#include "gpu/backends.h"
#include "tests/harness/planted.h"

namespace cutproof::harness {
namespace {

TEST(FreeRunning, AloneAsksForNoLockstep) {
  const auto backend = reference::make_backend();
  const Against against = compare(*backend, scene(), 4, AgainstMode::free_running);
  EXPECT_FALSE(against.lockstep);
  ASSERT_EQ(against.verdicts().size(), 1u);
  EXPECT_TRUE(against.holds());
  EXPECT_EQ(against.verdicts().front().property, "free-running: decisions");
  EXPECT_EQ(against.verdicts().front().checked, 4);
}

TEST(FreeRunning, CarriesADistanceOnAndDecidesNothingByIt) {
  Planted backend(reference::make_backend(), Stage::step, 1, [](const cutproof::Setup& setup, State& state) {
    state.x[kParticle].y += 1e-6 * setup.body.grid.spacing;
  });
  const Against against = compare(backend, scene(), 3, AgainstMode::free_running);
  EXPECT_TRUE(against.holds());
  EXPECT_FALSE(against.free_running->first_difference());
  ASSERT_EQ(against.free_running->frames().size(), 3u);
  EXPECT_EQ(against.free_running->frames()[0].position.max, 0);
  EXPECT_NEAR(against.free_running->frames()[1].position.max, 1e-6, 1e-9);
  EXPECT_GT(against.free_running->frames()[2].position.max, 0) << "the reference is not seeded anew";
}

// Rules that leave several answers are known by their promise (model/rules.h).
TEST(FreeRunning, DoesNotExplainAMergeThatIsNoAnswerOfItsRule) {
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published, MergeRule::single_pass}) {
    fixtures::Built built = build("three_cuts");
    built.setup.merge.rule = rule;
    Planted backend(reference::make_backend(), Stage::merge, kFrame,
                    [](const cutproof::Setup&, State& state) { ++state.clusters.number.back(); });
    const Against against = compare(backend, built, kFrame + 1);
    ASSERT_TRUE(against.free_running->first_difference());
    const FirstDifference& first = *against.free_running->first_difference();
    EXPECT_EQ(first.stage, Stage::merge);
    EXPECT_EQ(first.frame, kFrame);
    EXPECT_FALSE(first.explained) << "a number that no union keeps is no answer of any rule";
    EXPECT_EQ(against.free_running->verdict().holds, first.explained);
    EXPECT_EQ(against.lockstep->frames()[kFrame].topology_differences, 1);
  }
}

TEST(FreeRunning, EndsWithAStateThatCannotBeRead) {
  State torn = scene().state;
  torn.clusters.members.front() = 1 << 30;
  FreeRunning run(scene().setup, scene().state, scene().state, "torn");
  run.see(Stage::step, torn);
  EXPECT_FALSE(run.verdict().holds);
  EXPECT_FALSE(run.verdict().witness.text.empty());
  run.see(Stage::detect, torn);
  EXPECT_EQ(run.first_difference()->stage, Stage::step) << "the first";

  const FreeRunning loaded(scene().setup, scene().state, torn, "torn");
  EXPECT_FALSE(loaded.verdict().holds);
}

}  // namespace
}  // namespace cutproof::harness
