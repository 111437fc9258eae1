// One stage beside the reference's: what differs, what is left open, what cannot be read. (What a whole run shows
// stands in tests/harness/lockstep_test.cpp.)
#include "oracles/comparison/stage_comparison.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "harness/reference_stages.h"
#include "model/rules.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::stage_comparison_test {
namespace {

using tests::block_body;
using tests::box_clusters;
using tests::setup_of;
using tests::state_of;

// A block that has lost a corner, before its split.
struct Block {
  cutproof::Setup setup = setup_of(block_body(4, 4, 2, 0.01), 2);
  State before = state_of(setup.body, box_clusters(4, 4, 2, 2), 30);
  StageComparison comparison{setup, harness::reference_stages()};

  explicit Block(MergeRule rule = MergeRule::deterministic) {
    setup.merge.rule = rule;
    reference::update_rest_frames(setup.body, before.clusters);
    before.alive[0] = 0;
    before.removed = {0};
  }
  State after(void (*stage)(const cutproof::Setup&, State&)) const {
    State state = before;
    stage(setup, state);
    return state;
  }
};

// Names of the properties that fail, with commas between them.
std::string failures(const StageDifference& found) {
  std::string names;
  for (const Verdict& verdict : found.verdicts("")) {
    if (!verdict.holds) names += (names.empty() ? "" : ",") + verdict.property;
  }
  return names;
}

TEST(StageComparison, FindsTheReferenceEqualToItself) {
  Block block;
  const StageDifference found =
      block.comparison.compare(Stage::split, block.before, block.after(reference::split), true);
  EXPECT_TRUE(found.due);
  EXPECT_TRUE(found.decisions.empty());
  EXPECT_GT(found.error(Measure::mass).norm.count, 0);
  EXPECT_EQ(failures(found), "");
  EXPECT_EQ(found.verdicts("beside: ").front().property, "beside: topology");
}

TEST(StageComparison, SeesAStageThatWasDueAndOneThatWasNot) {
  Block block;
  const StageDifference left_out = block.comparison.compare(Stage::split, block.before, block.before, false);
  ASSERT_EQ(left_out.decisions.size(), 2u) << "it did not run, and so its clusters are others";
  EXPECT_EQ(failures(left_out), "topology");
  block.setup.merge.rule = MergeRule::none;
  const StageDifference unasked = block.comparison.compare(Stage::merge, block.before, block.before, true);
  EXPECT_FALSE(unasked.due);
  EXPECT_EQ(unasked.decisions.size(), 1u);
}

TEST(StageComparison, LeavesSetsOpenExactlyWhereARulePromisesNoUniqueAnswer) {
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
    Block block(rule);
    block.before = block.after(reference::split);
    const State unmerged = block.before;  // right clusters, but only one rule may leave them so
    ASSERT_NE(block.after(reference::merge).clusters.members, unmerged.clusters.members) << name_of(rule);
    const StageDifference found = block.comparison.compare(Stage::merge, block.before, unmerged, true);
    EXPECT_EQ(found.sets_are_open, !promise_of(rule).unique) << name_of(rule);
    EXPECT_FALSE(found.decisions.empty()) << name_of(rule);

    State turned = block.after(reference::merge);  // what no rule leaves open
    turned.clusters.rotation.back() = Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}};
    EXPECT_FALSE(block.comparison.compare(Stage::merge, block.before, turned, true).decisions.empty()) << name_of(rule);

    State other = unmerged;  // what no rule leaves open
    other.debris = {1};
    EXPECT_FALSE(block.comparison.compare(Stage::merge, block.before, other, true).decisions.empty()) << name_of(rule);
  }
}

TEST(StageComparison, ExpectsTheEndOfTheFrameAfterSkin) {
  Block block;
  block.setup.skin.wanted = false;
  State after = block.before;
  EXPECT_EQ(block.comparison.compare(Stage::skin, block.before, after, false).decisions.front().field, "frame");
  ++after.frame;
  EXPECT_TRUE(block.comparison.compare(Stage::skin, block.before, after, false).decisions.empty());
  after.clusters.number.back() += 3;
  EXPECT_EQ(block.comparison.compare(Stage::skin, block.before, after, false).decisions.front().field, "number");
}

TEST(StageComparison, SaysOfAStateThatCannotBeReadThatItCannot) {
  Block block;
  State torn = block.before;
  torn.clusters.members.front() = 1 << 30;
  const StageDifference found = block.comparison.compare(Stage::step, block.before, torn, true);
  EXPECT_FALSE(found.is_readable);
  const std::vector<Verdict> verdicts = found.verdicts("");
  ASSERT_EQ(verdicts.size(), 1u) << "nothing else can be said of it";
  EXPECT_FALSE(verdicts.front().holds);
  EXPECT_FALSE(verdicts.front().witness.text.empty());
}

TEST(StageComparison, MeasuresWhatALaterStageMoves) {
  Block block;
  State after = block.after(reference::split);
  after.x[5].z = std::numeric_limits<double>::quiet_NaN();
  after.v[6].x = 1;
  const StageDifference found = block.comparison.compare(Stage::split, block.before, after, true);
  EXPECT_FALSE(found.error(Measure::position).holds());
  EXPECT_EQ(found.error(Measure::position).norm.where, 5);
  EXPECT_FALSE(found.error(Measure::velocity).holds());
  EXPECT_EQ(found.error(Measure::velocity).norm.where, 6);
  EXPECT_TRUE(found.decisions.empty());
}

// Where a body is 3,000 h from where it rests, a vertex of single precision is stored to 2e-4 h.
TEST(StageComparison, AsksOfASkinFarAwayWhatSinglePrecisionCanHave) {
  for (const double away : {0.0, 3000.0}) {
    Block block;
    block.before.precision = Precision::binary32;
    for (Vec3& x : block.before.x) x += Vec3{away * block.setup.body.grid.spacing, 0, 0};
    State after = block.after(reference::skin);
    ++after.frame;
    for (int32_t c = 0; c < after.clusters.count(); ++c) after.clusters.number[static_cast<std::size_t>(c)] = c;
    after.skin.position[7].x += 2e-4 * block.setup.body.grid.spacing;
    EXPECT_EQ(failures(block.comparison.compare(Stage::skin, block.before, after, true)),
              away > 0 ? "" : "skin vertices");
    after.skin.position[7].x += 0.01 * block.setup.body.grid.spacing;
    EXPECT_EQ(failures(block.comparison.compare(Stage::skin, block.before, after, true)), "skin vertices");
  }
}

// An edge as long as ε h up to a quarter of a rounding in single precision.
TEST(StageComparison, CountsARemovalThatRoundingDecides) {
  cutproof::Setup setup = setup_of(block_body(2, 1, 1, 0.01));
  setup.detect.without_blade = true;
  State before = state_of(setup.body, {{0, 1}});
  before.x[0] = before.x[1];
  before.x[0].x -= setup.detect.epsilon * 0.01 * (1 + 0x1p-26);
  const State kept = before;
  StageComparison comparison(setup, harness::reference_stages());
  const StageDifference strict = comparison.compare(Stage::detect, before, kept, true);
  EXPECT_EQ(strict.removals, (std::vector<int32_t>{0, 1}));
  EXPECT_EQ(strict.undecidable.removals, 0);
  EXPECT_EQ(failures(strict), "removed particles");

  State coarse_before = before, coarse = kept;
  coarse_before.precision = coarse.precision = Precision::binary32;
  const StageDifference found = comparison.compare(Stage::detect, coarse_before, coarse, true);
  EXPECT_EQ(found.undecidable.removals, 2);
  EXPECT_EQ(failures(found), "");
  EXPECT_EQ(found.expected.alive, coarse.alive) << "the reference goes on with the backend's choice";
}

}  // namespace
}  // namespace cutproof::oracles::stage_comparison_test
