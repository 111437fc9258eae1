// A backend and the reference that run freely: the first decision that differs ends it, and rounding may explain it.
// (What both ways of comparing find of one deviation stands in lockstep_test.cpp.)
#include "harness/free_running.h"

#include <gtest/gtest.h>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/backends.h"
#include "tests/harness/planted.h"

namespace cutproof::harness::free_running_test {
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
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
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

// Two particles, one too far from the other, and a blade in a plane across the x axis, its negative side that of lower
// x or, turned, of higher. (The plate itself is far away, and touches nobody.)
struct PulledPair {
  cutproof::Setup setup;
  State state;
  void put_blade(double x, bool turned) {
    const BladePose pose = {{x, 100, 100}, {0, turned ? -1.0 : 1.0, 0}, {0, 0, 1}};
    setup.has_blade = true;
    setup.blade = {0.001, 0.001, 0, 0};
    setup.blade_moves = {{pose, pose, true, 0}};
    setup.stroke_end = {0};
  }
};
PulledPair pulled_pair(RemovedEnds remove) {
  PulledPair pair;
  cutproof::Setup& setup = pair.setup;
  setup.body = fixtures::block(2, 1, 1, 1.0);
  setup.step.substeps = 1;
  setup.step.iterations = 0;
  setup.substep_length = {0.01};
  setup.detect.remove = remove;
  pair.state = fixtures::cook(setup.body, {}, setup.expand, setup.merge, 1);
  pair.state.x[1].x += 1;
  return pair;
}

// The run whose second particle is moved by `moved` after the step, and which removes `gone`, beside the reference's.
FirstDifference where_runs_part(const PulledPair& pair, double moved, int32_t gone) {
  FreeRunning running(pair.setup, pair.state, pair.state, "a backend");
  State other = pair.state;
  other.x[1].x += moved;
  running.see(Stage::step, other);
  EXPECT_FALSE(running.first_difference());
  other.alive[at(gone)] = 0;
  other.removed = {gone};
  running.see(Stage::detect, other);
  if (!running.first_difference()) {
    ADD_FAILURE() << "they decide alike";
    return {};
  }
  EXPECT_EQ(running.first_difference()->what.particles, (std::vector<int32_t>{0, 1}));
  return *running.first_difference();
}

// One end of each edge: the plane of the blade is just beside the second. The first goes instead of the second: right
// for a run in which the second is on the other side of the plane, and explained by how far the runs are apart; wrong
// for one in which it is not.
TEST(FreeRunning, ExplainsAnotherEndOfAnEdgeByTheSideOfTheBladeThatItIsOn) {
  constexpr double off = 1e-6;
  PulledPair pair = pulled_pair(RemovedEnds::one);
  pair.put_blade(pair.state.x[1].x - off, true);
  for (const bool on_the_other_side : {true, false}) {
    const FirstDifference first = where_runs_part(pair, on_the_other_side ? -off - 1e-9 : 0, 0);
    ASSERT_TRUE(first.margin);
    EXPECT_NEAR(*first.margin, off, 1e-12);
    EXPECT_EQ(first.reach > off, on_the_other_side);
    EXPECT_EQ(first.explained, on_the_other_side);
  }
}

// The nearer end of each edge: each particle is a cluster of its own, and the plane all but so much nearer to the
// positive one that it goes. In the other run it went: right where that run has it nearer by so much, and explained by
// how far the runs are apart; wrong where it has not.
TEST(FreeRunning, ExplainsAnotherEndOfAnEdgeByWhichIsNearerToTheBlade) {
  constexpr double off = 1e-6;
  PulledPair pair = pulled_pair(RemovedEnds::nearer);
  Clusters& clusters = pair.state.clusters;
  clusters = {};
  clusters.number = clusters.members = {0, 1};
  clusters.offsets = {0, 1, 2};
  clusters.rotation.resize(2);
  clusters.degenerate = {1, 1};
  clusters.mass.resize(2);
  clusters.rest_center.resize(2);
  reference::update_rest_frames(pair.setup.body, clusters);
  const double middle = (pair.state.x[0].x + pair.state.x[1].x) / 2;
  pair.put_blade(middle + kNearerBy / 2 - off, false);
  for (const bool nearer_there : {true, false}) {
    const FirstDifference first = where_runs_part(pair, nearer_there ? -2 * off - 1e-9 : 0, 1);
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
}  // namespace cutproof::harness::free_running_test
