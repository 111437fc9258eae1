// Expansion: every edge covered, and no cluster grown without need.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::expand_test {
namespace {

using namespace cutproof::tests;

// A row of six whose edge 2-3 lies in no cluster.
Pair uncovered_row(const Lists& after) { return pair_of(block_body(6, 1, 1), {{0, 1, 2}, {3, 4, 5}}, after); }

TEST(Expansion, AcceptsTheOtherEndOfAnUncoveredEdge) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsAnEdgeLeftUncovered) {
  Pair pair = uncovered_row({{0, 1, 2}, {3, 4, 5}});
  pair.after.edge_covered = true;
  const Verdict verdict = expansion(pair.setup, pair.before, pair.after);
  expect_rejected(verdict, {}, {2, 3});
  EXPECT_EQ(verdict.witness.path, Numbers({2, 3}));
}

TEST(Expansion, RejectsAPromiseThatWasNotMade) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {}, {});
}

TEST(Expansion, RejectsAClusterThatShrank) {
  Pair pair = uncovered_row({{1, 2, 3}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {0});
}

TEST(Expansion, RejectsAJumpOverAGap) {
  Pair pair = uncovered_row({{0, 1, 2, 3, 5}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {5});
}

TEST(Expansion, RejectsASecondLayerUnlessTheDepthAllowsIt) {
  Pair pair = uncovered_row({{0, 1, 2, 3, 4}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {4});
  pair.setup.expand.depth = 2;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsGrowthAcrossACut) {
  // 3 is removed and dead: 4 is no neighbour of anything in cluster 0.
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {4, 5}}, {{0, 1, 2, 4}, {4, 5}});
  remove_particles(pair.before, {3});
  remove_particles(pair.after, {3});
  pair.after.edge_covered = true;
  pair.setup.expand.depth = 3;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {4});
}

TEST(Expansion, RejectsGrowthWithoutNeed) {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {{0, 1, 2, 3}, {2, 3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
}

TEST(Expansion, RejectsAnyGrowthWhereEveryEdgeWasCoveredOrNothingExpands) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  pair.before.edge_covered = pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
  pair.before.edge_covered = pair.after.edge_covered = false;
  pair.setup.expand.rule = ExpandRule::none;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
  pair.after = pair.before;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsOtherClustersThanBefore) {
  Pair pair = uncovered_row({range(0, 6)});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {1}, {});
}

TEST(Expansion, PublishedFreesSingleIsolatedClustersOnly) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {2, 3, 4, 5}});
  pair.setup.expand.rule = ExpandRule::published;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
  pair.after = pair.before;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {});
  // Two groups of two: each cluster overlaps another, so none may grow, isolated as the groups are.
  Pair groups = pair_of(block_body(6, 1, 1), {{0, 1}, {1, 2}, {3, 4}, {4, 5}}, {{0, 1}, {1, 2}, {3, 4}, {4, 5}});
  groups.setup.expand.rule = ExpandRule::published;
  expect_holds(expansion(groups.setup, groups.before, groups.after));
  set_clusters(groups.setup, groups.after, {{0, 1}, {1, 2, 3}, {3, 4}, {4, 5}}, {0, 1, 2, 3});
  expect_rejected(expansion(groups.setup, groups.before, groups.after), {1}, {3});
  EXPECT_EQ(expansion(groups.setup, groups.before, groups.after).witness.text,
            "cluster 1 took in particle 3, though that cluster was not isolated");
}

TEST(Expansion, AcceptsABodyOfNoneAndOfOneParticle) {
  Pair none = pair_of(body_of({}), {}, {});
  none.after.edge_covered = true;
  expect_holds(expansion(none.setup, none.before, none.after));
  Pair one = pair_of(block_body(1, 1, 1), {{0}}, {{0}});
  one.after.edge_covered = true;
  expect_holds(expansion(one.setup, one.before, one.after));
}

}  // namespace
}  // namespace cutproof::oracles::expand_test
