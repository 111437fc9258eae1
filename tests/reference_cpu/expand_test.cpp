// Expand against method.md §7.
#include <gtest/gtest.h>

#include <random>

#include "reference_cpu/reference.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::expand_test {
namespace {

using namespace cutproof::tests;

Setup setup_with(Body body, ExpandRule rule, int32_t depth = 1) {
  auto setup = setup_of(std::move(body));
  setup.expand.rule = rule;
  setup.expand.depth = depth;
  return setup;
}

Lists expanded(const Body& body, const Lists& lists, ExpandRule rule, int32_t depth = 1) {
  State state = state_of(body, lists);
  reference::expand(setup_with(body, rule, depth), state);
  return lists_of(state.clusters);
}

TEST(EdgeCover, LetsTheSmallerClusterTakeInTheOtherEnd) {
  EXPECT_EQ(expanded(block_body(5, 1, 1), {{0, 1, 2}, {3, 4}}, ExpandRule::edge_cover), (Lists{{0, 1, 2}, {2, 3, 4}}));
}

TEST(EdgeCover, LetsTheLowerNumberTakeInTheOtherEndAmongEquals) {
  EXPECT_EQ(expanded(block_body(4, 1, 1), {{0, 1}, {2, 3}}, ExpandRule::edge_cover), (Lists{{0, 1, 2}, {2, 3}}));
}

TEST(EdgeCover, LooksAtEveryClusterThatHoldsAnEnd) {
  // Particle 2 is held by {0, 1, 2} and by {2} alone: the smallest of all memberships takes in particle 3.
  EXPECT_EQ(expanded(block_body(6, 1, 1), {{0, 1, 2}, {3, 4, 5}, {2}}, ExpandRule::edge_cover),
            (Lists{{0, 1, 2}, {3, 4, 5}, {2, 3}}));
}

TEST(EdgeCover, GoesBySizesAndMembershipsAtTheStagesInput) {
  // {2} takes in both 1 and 3, although after the first of them it is no smaller than {0, 1} any more.
  EXPECT_EQ(expanded(block_body(5, 1, 1), {{0, 1}, {2}, {3, 4}}, ExpandRule::edge_cover),
            (Lists{{0, 1}, {1, 2, 3}, {3, 4}}));
}

TEST(EdgeCover, DoesNotReachAcrossDeadParticles) {
  const Body body = block_body(5, 1, 1);
  State state = state_of(body, {{0, 1}, {3, 4}});
  state.alive[2] = 0;
  reference::expand(setup_with(body, ExpandRule::edge_cover, 3), state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{0, 1}, {3, 4}}));
}

TEST(EdgeCover, PromisesIt) {
  const Body body = block_body(4, 1, 1);
  State state = state_of(body, {{0, 1}, {2, 3}});
  ASSERT_FALSE(state.edge_covered);
  reference::expand(setup_with(body, ExpandRule::edge_cover), state);
  EXPECT_TRUE(state.edge_covered);
}

TEST(EdgeCover, KeepsNumbersRotationsAndFlagsAndRecomputesRestFrames) {
  const Body body = block_body(4, 1, 1);
  State state = state_of(body, {{0, 1}, {2, 3}});
  state.clusters.number = {4, 6};
  state.clusters.rotation[1] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  state.clusters.degenerate[0] = 1;
  Clusters expected = state.clusters;
  reference::expand(setup_with(body, ExpandRule::edge_cover), state);
  expected.offsets = {0, 3, 5};
  expected.members = {0, 1, 2, 2, 3};
  expected.mass = {2.5, 1.5};
  expected.rest_center = {{(1 + 2 + 1.5) / 2.5, 1, 1}, {(1.5 + 4) / 1.5, 1, 1}};
  EXPECT_EQ(state.clusters, expected);
}

TEST(EdgeCover, TakesInFurtherLayersOfParticlesThatShareAClusterWithTheLast) {
  // Cluster {0} takes in 1; then 2, which shares {1, 2, 3} with 1; then 3. Not 4, which shares nothing with 3.
  const Lists input = {{0}, {1, 2, 3}, {4, 5, 6, 7, 8}};
  const Body body = block_body(9, 1, 1);
  EXPECT_EQ(expanded(body, input, ExpandRule::edge_cover, 1), (Lists{{0, 1}, {1, 2, 3, 4}, {4, 5, 6, 7, 8}}));
  EXPECT_EQ(expanded(body, input, ExpandRule::edge_cover, 2), (Lists{{0, 1, 2}, {1, 2, 3, 4, 5}, {4, 5, 6, 7, 8}}));
  EXPECT_EQ(expanded(body, input, ExpandRule::edge_cover, 5),
            (Lists{{0, 1, 2, 3}, {1, 2, 3, 4, 5, 6, 7, 8}, {4, 5, 6, 7, 8}}));
}

TEST(EdgeCover, ReachesI4KeepsI1AndOnlyGrowsOnRandomCovers) {
  constexpr uint32_t kSeed = 77;
  std::mt19937 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  int64_t uncoupled = 0;
  for (int round = 0; round < 200; ++round) {
    const Body body = random_body(random, {5, 5, 4}, 0.7);
    const Lists before = random_cover(random, body, draw(random, 1, 15));
    const int32_t depth = draw(random, 1, 3);
    const Lists after = expanded(body, before, ExpandRule::edge_cover, depth);
    const std::vector<uint8_t> alive(body.node.size(), 1);
    const auto graph = graph_labels(body, alive);
    uncoupled += coupling_labels(body, before) != graph;
    ASSERT_EQ(uncovered_edges(body, alive, after), 0) << "seed " << kSeed << ", round " << round;
    ASSERT_EQ(coupling_labels(body, after), graph) << "seed " << kSeed << ", round " << round;
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t c = 0; c < before.size(); ++c) {
      ASSERT_TRUE(is_connected(body, after[c]));
      ASSERT_TRUE(std::is_sorted(after[c].begin(), after[c].end()));
      ASSERT_EQ(std::adjacent_find(after[c].begin(), after[c].end()), after[c].end());
      ASSERT_TRUE(std::includes(after[c].begin(), after[c].end(), before[c].begin(), before[c].end()));
    }
  }
  EXPECT_GT(uncoupled, 0);
}

TEST(PublishedExpansion, LetsAClusterThatSharesNothingTakeInTheOutsideEnds) {
  EXPECT_EQ(expanded(block_body(6, 1, 1), {{0, 1}, {1, 2}, {3}, {4, 5}}, ExpandRule::published),
            (Lists{{0, 1}, {1, 2}, {2, 3, 4}, {3, 4, 5}}));
}

TEST(PublishedExpansion, LeavesAClusterAloneThatSharesOneParticle) {
  const Lists input = {{0, 1, 2}, {2, 3}};
  EXPECT_EQ(expanded(block_body(4, 1, 1), input, ExpandRule::published), input);
}

TEST(PublishedExpansion, OverlooksGroupsThatAreIsolatedTogetherWhichEdgeCoverJoins) {
  const Lists input = {{0, 1}, {1, 2}, {3, 4}, {4, 5}};
  const Body body = block_body(6, 1, 1);
  EXPECT_EQ(expanded(body, input, ExpandRule::published), input);
  const auto classes = coupling_labels(body, expanded(body, input, ExpandRule::edge_cover));
  EXPECT_EQ(classes, std::vector<int32_t>(6, 0));
}

TEST(PublishedExpansion, PromisesNoEdgeCover) {
  const Body body = block_body(4, 1, 1);
  State state = state_of(body, {{0, 1}, {2, 3}});
  reference::expand(setup_with(body, ExpandRule::published), state);
  EXPECT_FALSE(state.edge_covered);
}

TEST(Expand, DoesNothingUnderTheRuleNone) {
  const Body body = block_body(4, 1, 1);
  State state = state_of(body, {{0, 1}, {2, 3}});
  const State before = state;
  reference::expand(setup_with(body, ExpandRule::none), state);
  EXPECT_EQ(state, before);
}

}  // namespace
}  // namespace cutproof::expand_test
