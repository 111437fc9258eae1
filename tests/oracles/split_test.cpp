// Split: exactly the components of what is left of each cluster.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::split_test {
namespace {

using namespace cutproof::tests;

TEST(SplitExactness, AcceptsComponentsNumberedByClusterAndSmallestParticle) {
  const Pair pair = cut_row();
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 4);
}

TEST(SplitExactness, RejectsAComponentThatWasGluedToAnother) {
  Pair pair = cut_row();
  const auto rotations = pair.after.clusters.rotation;
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3, 5}, {3}, {7, 8}, {5, 6, 7}}, {0, 2, 5, 6, 8});
  pair.after.clusters.rotation.assign(rotations.begin(), rotations.begin() + 5);
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  expect_rejected(verdict, {2}, {1, 5});
  EXPECT_EQ(verdict.measured, 3);  // 7 is missing too, and 8 has not its parent's rotation
}

TEST(SplitExactness, RejectsAComponentThatWasTornApart) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  const auto parent = cut_row().after.clusters.rotation;
  pair.after.clusters.rotation = parent;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {2}, {3, 1});
}

TEST(SplitExactness, RejectsATailThatWasLost) {
  Pair pair = cut_row();
  const auto rotations = pair.after.clusters.rotation;
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}}, {0, 2, 5, 6, 7});
  pair.after.clusters.rotation.assign(rotations.begin(), rotations.begin() + 5);
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  expect_rejected(verdict, {8, 5}, {5});  // what is left of 5 is there to be shown, 8 is not
  EXPECT_EQ(verdict.witness.text,
            "cluster 5 fell apart, and its piece of 3 particles (the smallest 5) has become no cluster");
}

TEST(SplitExactness, SaysWhatHasBecomeOfAPiece) {
  const auto text_of = [](const Lists& lists, const Numbers& numbers) {
    Pair pair = cut_row();
    set_clusters(pair.setup, pair.after, lists, numbers);
    pair.after.clusters.rotation.assign(lists.size(), turn_about_z(0));
    return split_exactness(pair.setup, pair.before, pair.after).witness.text;
  };
  EXPECT_EQ(text_of({{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5, 6, 7}}, {0, 2, 5, 6, 8}),
            "cluster 2 did not inherit the rotation of cluster 2: it is turned by 57.3 degrees");
  EXPECT_EQ(text_of({{0, 1, 2}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 5, 6, 7, 8}),
            "cluster 2 is missing: it should have kept the first piece of what is left of it, 3 particles (the "
            "smallest 1)");
  EXPECT_EQ(text_of({{1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}}, {2, 5, 6, 7, 8}),
            "cluster 0 is missing, though it lost nothing: it has 3 particles (the smallest 0)");
  Pair pair = cut_row();
  const auto rotations = pair.after.clusters.rotation;
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5, 6, 7}}, {0, 2, 5, 6, 8});
  pair.after.clusters.rotation = {rotations[0], rotations[1], rotations[2], rotations[3], rotations[5]};
  EXPECT_EQ(split_exactness(pair.setup, pair.before, pair.after).witness.text,
            "cluster 2 fell apart, and its piece of 1 particle (5) has become no cluster");
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5, 6, 7}, {5}}, {0, 2, 5, 6, 8, 9});
  pair.after.clusters.rotation = {rotations[0], rotations[1], rotations[2], rotations[3], rotations[5], rotations[4]};
  EXPECT_EQ(split_exactness(pair.setup, pair.before, pair.after).witness.text,
            "cluster 2 fell apart, and its piece of 1 particle (5) is cluster 9, where it should be cluster 7");
}

TEST(SplitExactness, RejectsNumbersInAnotherOrder) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5, 6, 7}, {5}}, {0, 2, 5, 6, 7, 8});
  const auto& turned = cut_row().after.clusters.rotation;
  pair.after.clusters.rotation = {turned[0], turned[1], turned[2], turned[3], turned[5], turned[4]};
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, Numbers({7}));
}

TEST(SplitExactness, RejectsTheNumberGoingToTheOtherComponent) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {5}, {3}, {7, 8}, {1, 2, 3}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  pair.after.clusters.rotation = cut_row().after.clusters.rotation;
  EXPECT_EQ(split_exactness(pair.setup, pair.before, pair.after).witness.clusters, Numbers({2}));
}

TEST(SplitExactness, RejectsTouchingAClusterThatLostNothing) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  pair.after.clusters.rotation = cut_row().after.clusters.rotation;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {0}, {2, 0});
  pair = cut_row();
  pair.after.clusters.rotation[3] = Mat3{};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {6}, {});
}

TEST(SplitExactness, RejectsANewClusterWithoutItsParentsRotation) {
  Pair pair = cut_row();
  pair.after.clusters.rotation[5] = Mat3{};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {8}, {});
}

TEST(SplitExactness, RejectsADeadParticleKept) {
  Pair pair = cut_row();
  pair.after = pair.before;
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, Numbers({2}));
}

TEST(SplitExactness, RejectsAClusterFromNowhere) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}, {8}}, {0, 2, 5, 6, 7, 8, 9});
  auto rotations = cut_row().after.clusters.rotation;
  rotations.emplace_back();
  pair.after.clusters.rotation = rotations;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {9}, {8});
}

TEST(SplitExactness, TakesComponentsWithinTheClusterNotWithinTheTissue) {
  // 6 7 8
  // 3 4 5
  // 0 1 2   4 is removed from {3, 4, 5}: 3 and 5 are connected around it, but not within the cluster.
  Pair pair = pair_of(block_body(3, 3, 1), {{3, 4, 5}, range(0, 9)}, {});
  remove_particles(pair.before, {4});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{3}, {0, 1, 2, 3, 5, 6, 7, 8}, {5}}, {0, 1, 2});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  set_clusters(pair.setup, pair.after, {{3, 5}, {0, 1, 2, 3, 5, 6, 7, 8}}, {0, 1});
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {0}, {3, 5});
}

TEST(SplitExactness, AcceptsAClusterThatVanished) {
  Pair pair = pair_of(block_body(4, 1, 1), {{0}, {0, 1, 2, 3}}, {});
  remove_particles(pair.before, {0});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{1, 2, 3}}, {1});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
}

TEST(SplitExactness, AcceptsNothingRemovedAndABodyCutAwayEntirely) {
  Pair pair = pair_of(block_body(4, 1, 1), {{0, 1}, {1, 2, 3}}, {{0, 1}, {1, 2, 3}});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  remove_particles(pair.before, {0, 1, 2, 3});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {}, {});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  const Pair none = pair_of(body_of({}), {}, {});
  expect_holds(split_exactness(none.setup, none.before, none.after));
  EXPECT_EQ(split_exactness(none.setup, none.before, none.after).checked, 0);
}

// A row of six cut at 2: {0, 1} is debris if fewer than three particles are, {3, 4, 5} is not.
Pair debris_row() {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2, 3}, {3, 4, 5}}, {});
  pair.setup.split.debris = 3;
  remove_particles(pair.before, {2});
  pair.after = pair.before;
  pair.after.alive[0] = pair.after.alive[1] = 0;
  pair.after.debris = {0, 1};
  set_clusters(pair.setup, pair.after, {{3}, {3, 4, 5}}, {0, 1});
  return pair;
}

TEST(SplitExactness, AcceptsDebrisBelowTheLimitOnly) {
  const Pair pair = debris_row();
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
}

TEST(SplitExactness, RejectsDebrisThatWasKept) {
  Pair pair = debris_row();
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{0, 1}, {3, 4, 5}, {3}}, {0, 1, 2});
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {0});
}

TEST(SplitExactness, RejectsDebrisThatIsLargeEnough) {
  Pair pair = debris_row();
  pair.setup.split.debris = 2;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {0});
}

TEST(SplitExactness, RejectsDebrisThatIsNotListed) {
  Pair pair = debris_row();
  pair.after.debris = {0};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {1});
}

}  // namespace
}  // namespace cutproof::oracles::split_test
