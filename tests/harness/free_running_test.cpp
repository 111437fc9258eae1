// A backend and the reference that run freely: the first decision that differs ends it, and rounding may explain it.
// (What both ways of comparing find of one deviation stands in lockstep_test.cpp.)
#include "harness/free_running.h"

#include <gtest/gtest.h>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
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

// One end of each edge: two particles too far apart, and the plane of the blade just beside the second. (The plate
// itself is far away, and touches nobody.) The first goes instead of the second: right for a run in which the second is
// on the other side of the plane, and explained by how far the runs are apart; wrong for one in which it is not.
TEST(FreeRunning, ExplainsAnotherEndOfAnEdgeByTheSideOfTheBladeThatItIsOn) {
  constexpr double off = 1e-6;
  for (const bool on_the_other_side : {true, false}) {
    cutproof::Setup setup;
    setup.body = fixtures::block(2, 1, 1, 1.0);
    setup.step.substeps = 1;
    setup.step.iterations = 0;
    setup.substep_length = {0.01};
    setup.detect.remove = RemovedEnds::one;
    State start = fixtures::cook(setup.body, {}, setup.expand, setup.merge, 1);
    start.x[1].x += 1;
    const BladePose pose = {{start.x[1].x - off, 100, 100}, {0, -1, 0}, {0, 0, 1}};  // its negative side is that of 1
    setup.has_blade = true;
    setup.blade = {0.001, 0.001, 0, 0};
    setup.blade_moves = {{pose, pose, true, 0}};
    setup.stroke_end = {0};
    FreeRunning running(setup, start, start, "a backend");
    State other = start;
    if (on_the_other_side) other.x[1].x -= off + 1e-9;
    running.see(Stage::step, other);
    ASSERT_FALSE(running.first_difference());
    other.alive[0] = 0;
    other.removed = {0};
    running.see(Stage::detect, other);
    ASSERT_TRUE(running.first_difference());
    const FirstDifference& first = *running.first_difference();
    EXPECT_EQ(first.what.particles, (std::vector<int32_t>{0, 1}));
    ASSERT_TRUE(first.margin);
    EXPECT_NEAR(*first.margin, off, 1e-12);
    EXPECT_EQ(first.reach > off, on_the_other_side);
    EXPECT_EQ(first.explained, on_the_other_side);
  }
}

// The nearer end of each edge: two particles too far apart, each a cluster of its own, and the plane of the blade all
// but so much nearer to the positive one that it goes. In the other run it went: right where that run has it nearer by
// so much, and explained by how far the runs are apart; wrong where it has not.
TEST(FreeRunning, ExplainsAnotherEndOfAnEdgeByWhichIsNearerToTheBlade) {
  constexpr double off = 1e-6;
  for (const bool nearer_there : {true, false}) {
    cutproof::Setup setup;
    setup.body = fixtures::block(2, 1, 1, 1.0);
    setup.step.substeps = 1;
    setup.step.iterations = 0;
    setup.substep_length = {0.01};
    setup.detect.remove = RemovedEnds::nearer;
    State start = fixtures::cook(setup.body, {}, setup.expand, setup.merge, 1);
    start.clusters = {};
    for (int32_t c = 0; c < 2; ++c) {
      start.clusters.number.push_back(c);
      start.clusters.offsets.push_back(c + 1);
      start.clusters.members.push_back(c);
      start.clusters.rotation.emplace_back();
      start.clusters.degenerate.push_back(1);
    }
    start.clusters.mass.resize(2);
    start.clusters.rest_center.resize(2);
    reference::update_rest_frames(setup.body, start.clusters);
    start.x[1].x += 1;
    const double middle = (start.x[0].x + start.x[1].x) / 2;
    // Its negative side is that of 0, from which it is farther by an eighth of h, less 2 off.
    const BladePose pose = {{middle + kNearerBy / 2 - off, 100, 100}, {0, 1, 0}, {0, 0, 1}};
    setup.has_blade = true;
    setup.blade = {0.001, 0.001, 0, 0};
    setup.blade_moves = {{pose, pose, true, 0}};
    setup.stroke_end = {0};
    FreeRunning running(setup, start, start, "a backend");
    State other = start;
    if (nearer_there) other.x[1].x -= 2 * off + 1e-9;
    running.see(Stage::step, other);
    ASSERT_FALSE(running.first_difference());
    other.alive[1] = 0;
    other.removed = {1};
    running.see(Stage::detect, other);
    ASSERT_TRUE(running.first_difference());
    const FirstDifference& first = *running.first_difference();
    EXPECT_EQ(first.what.particles, (std::vector<int32_t>{0, 1}));
    ASSERT_TRUE(first.margin);
    EXPECT_NEAR(*first.margin, 2 * off, 1e-12);
    EXPECT_EQ(first.reach > 2 * off, nearer_there);
    EXPECT_EQ(first.explained, nearer_there);
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
