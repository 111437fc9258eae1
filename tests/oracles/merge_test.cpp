// Merging: legal and maximal.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::merge_test {
namespace {

using namespace cutproof::tests;

// Merging on a row of n particles.
struct Merge {
  Merge(int32_t n, const Lists& before, int32_t tau, int32_t cap) : pair(pair_of(block_body(n, 1, 1), before, before)) {
    pair.before.tau = pair.after.tau = tau;
    pair.before.cap = pair.after.cap = cap;
    for (std::size_t c = 0; c < before.size(); ++c) {
      pair.before.clusters.rotation[c] = turn_about_z(static_cast<double>(c));
    }
  }
  // Every cluster has the rotation of the one whose number it keeps.
  Verdict judge(const Lists& after, const Numbers& numbers) {
    set_clusters(pair.setup, pair.after, after, numbers);
    for (std::size_t c = 0; c < numbers.size(); ++c) pair.after.clusters.rotation[c] = turn_about_z(numbers[c]);
    return merge_legality(pair.setup, pair.before, pair.after);
  }
  Verdict cap() const { return cap_kept(pair.setup, pair.before, pair.after); }
  Pair pair;
};

TEST(MergeLegality, AcceptsNothingMergedAndSmallClustersMerged) {
  Merge merge(8, {{0, 1, 2}, {2, 3}, {4}, {4, 5, 6, 7}}, 3, 6);
  expect_holds(merge.judge({{0, 1, 2}, {2, 3}, {4}, {4, 5, 6, 7}}, {0, 1, 2, 3}));
  expect_holds(merge.judge({{0, 1, 2, 3}, {4}, {4, 5, 6, 7}}, {0, 2, 3}));     // sharing a particle
  expect_holds(merge.judge({{0, 1, 2}, {2, 3, 4}, {4, 5, 6, 7}}, {0, 1, 3}));  // joined by an edge
  expect_holds(merge.judge({{0, 1, 2}, {2, 3}, {4, 5, 6, 7}}, {0, 1, 3}));     // contained
  expect_holds(merge.judge({{0, 1, 2, 3, 4}, {4, 5, 6, 7}}, {0, 3}));          // three into one
  expect_holds(merge.judge({{0, 1, 2}, {2, 3, 4, 5, 6, 7}}, {0, 3}));
}

TEST(MergeLegality, HoldsOfEveryRuleAlike) {
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
    Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
    merge.pair.setup.merge.rule = rule;
    expect_holds(merge.judge({range(0, 6)}, {0}));
    expect_holds(merge.cap());
    merge.pair.before.cap = 5;
    expect_holds(merge.judge({range(0, 6)}, {0}));
    expect_rejected(merge.cap(), {0}, {});
  }
}

TEST(MergeLegality, RejectsAnyMergeWhereTheSceneMergesNone) {
  Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
  merge.pair.setup.merge.rule = MergeRule::none;
  expect_holds(merge.judge({{0, 1, 2, 3}, {4, 5}}, {0, 1}));
  expect_rejected(merge.judge({range(0, 6)}, {0}), {}, {});
}

TEST(MergeLegality, RejectsAUnionAboveTheCapButNotAContainedCluster) {
  Merge merge(8, {range(0, 6), {2, 3}, {6, 7}}, 3, 5);
  expect_holds(merge.judge({range(0, 6), {6, 7}}, {0, 2}));
  expect_holds(merge.cap());
  merge.judge({range(0, 8)}, {0});
  const Verdict verdict = merge.cap();
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("more than cap = 5"), std::string::npos) << verdict.witness.text;
}

TEST(MergeLegality, RejectsAMergeOfTwoThatDoNotTouch) {
  Merge merge(8, {{0, 1, 2, 3, 4}, {6, 7}, {5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3, 4, 6, 7}, {5}}, {0, 2}), {0, 1}, {0, 6});
  expect_holds(merge.judge({range(0, 8)}, {0}));  // through the one between them
}

TEST(MergeLegality, RejectsAMergeAcrossACut) {
  Merge merge(5, {{0, 1}, {3, 4}}, 3, 8);
  remove_particles(merge.pair.before, {2});
  merge.pair.after = merge.pair.before;
  expect_rejected(merge.judge({{0, 1, 3, 4}}, {0}), {0, 1}, {0, 3});
}

TEST(MergeLegality, RejectsAClusterUsedTwice) {
  Merge merge(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3}, {2, 3}, {3, 4, 5}}, {0, 1, 2}), {0}, {3});  // merged and kept
  // Merged into both sides: 3 is new to cluster 0, 2 to cluster 2, and only cluster 1 could explain either.
  const Verdict both = merge.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2});
  EXPECT_FALSE(both.holds);
  EXPECT_EQ(both.witness.clusters, Numbers({0, 2}));
}

TEST(MergeLegality, FindsTheOneAssignmentThatExplainsEverything) {
  // Cluster 1 = {2, 3} lies in both results; 0 needs it to reach 3, and 2 does not because 3 = {1, 2} gives it 2.
  Merge merge(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}, {2}}, 3, 8);
  expect_holds(merge.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2}));
  // Now both need it, but {2, 3} occurs twice.
  Merge twice(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}, {2, 3}}, 3, 8);
  expect_holds(twice.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2}));
}

TEST(MergeLegality, RejectsALostClusterAndALostParticle) {
  Merge merge(6, {{0, 1, 2}, {2, 3, 4}, {4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2}, {2, 3, 4}}, {0, 1}), {2}, {5});
  expect_rejected(merge.judge({{0, 1, 2}, {2, 3}, {4, 5}}, {0, 1, 2}), {1}, {4});
}

TEST(MergeLegality, RejectsAParticleThatNobodyHeld) {
  Merge merge(6, {{0, 1, 2}, {2, 3, 4}, {4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3}, {2, 3, 4}, {4, 5}}, {0, 1, 2}), {0}, {3});
}

// Small is what has fewer than tau particles.
TEST(MergeLegality, HoldsExactlyUpToTau) {
  for (const int32_t size : {1, 2, 3, 4}) {
    Merge merge(8, {{0, 1, 2}, range(3, 3 + size)}, 3, 5);
    const Verdict verdict = merge.judge({range(0, 3 + size)}, {0});
    EXPECT_EQ(verdict.holds, size < 3) << size;
  }
}

TEST(CapKept, HoldsExactlyUpToTheCap) {
  Merge merge(8, {{0, 1, 2}, {3, 4}}, 3, 5);
  (void)merge.judge({range(0, 5)}, {0});
  for (const int32_t cap : {4, 5, 6}) {
    merge.pair.before.cap = cap;
    EXPECT_EQ(merge.cap().holds, cap >= 5) << cap;
  }
}

// Clusters that were above the cap already may stay so, and take in what lies inside them.
TEST(CapKept, HoldsOfWhatHasNotGrown) {
  Merge merge(8, {range(0, 7), {3, 4}}, 3, 5);
  (void)merge.judge({range(0, 7)}, {0});
  expect_holds(merge.cap());
  (void)merge.judge({range(0, 8)}, {0});
  expect_rejected(merge.cap(), {0}, {});
  // A cluster that nobody had before has grown from nothing.
  (void)merge.judge({range(0, 7), range(0, 6)}, {0, 9});
  expect_rejected(merge.cap(), {9}, {});
}

TEST(MergeLegality, RejectsMergingAwayAClusterThatIsNotSmall) {
  Merge merge(7, {{0, 1, 2}, {3, 4, 5, 6}}, 3, 8);
  expect_rejected(merge.judge({range(0, 7)}, {0}), {1, 0}, {});
}

TEST(MergeLegality, RejectsATargetThatLostItsNumber) {
  // The small cluster 1 merges into 0, but the union is called 1.
  Merge merge(5, {{0, 1, 2}, {3, 4}}, 3, 8);
  expect_rejected(merge.judge({range(0, 5)}, {1}), {0, 1}, {});
  expect_rejected(merge.judge({range(0, 5)}, {7}), {7}, {});
}

TEST(MergeLegality, RejectsARotationThatIsNotTheTargets) {
  Merge merge(5, {{0, 1, 2}, {3, 4}}, 3, 8);
  (void)merge.judge({range(0, 5)}, {0});
  merge.pair.after.clusters.rotation[0] = turn_about_z(1);
  const auto judged = [&] { return merge_legality(merge.pair.setup, merge.pair.before, merge.pair.after); };
  expect_rejected(judged(), {0}, {});
  EXPECT_EQ(judged().witness.text, "cluster 0 did not keep its rotation: it is turned by 57.3 degrees");
  merge.pair.after.clusters.rotation[0] = turn_about_z(1e-9);
  EXPECT_EQ(judged().witness.text, "cluster 0 did not keep its rotation: it is turned by 5.73e-08 degrees");
  merge.pair.after.clusters.rotation[0] = merge.pair.before.clusters.rotation[0];
  merge.pair.after.clusters.degenerate[0] = 1;
  EXPECT_EQ(judged().witness.text, "cluster 0 did not keep its rotation: it is the same, but is marked as not unique");
}

TEST(MergeLegality, AcceptsABodyOfNoneAndOfOneParticle) {
  const Pair none = pair_of(body_of({}), {}, {});
  expect_holds(merge_legality(none.setup, none.before, none.after));
  EXPECT_EQ(merge_legality(none.setup, none.before, none.after).checked, 0);
  Merge one(1, {{0}}, 2, 8);
  expect_holds(one.judge({{0}}, {0}));
  expect_rejected(one.judge({}, {}), {0}, {0});
}

// A merge done at random but by the rules must always be explained; one particle more must not.
TEST(MergeLegality, ExplainsRandomLegalMergesAndNoticesAnExtraParticle) {
  constexpr uint64_t kSeed = 5;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t merges = 0, noticed = 0;
  for (int round = 0; round < 300; ++round) {
    constexpr int32_t kSide = 6;
    Lists sets;
    std::vector<uint8_t> seen(kSide * kSide, 0);
    for (int32_t k = 0; k < 25; ++k) {
      const auto i0 = static_cast<int32_t>(random() % kSide), j0 = static_cast<int32_t>(random() % kSide);
      const auto w = static_cast<int32_t>(1 + random() % 3), h = static_cast<int32_t>(1 + random() % 3);
      std::vector<int32_t> set;
      for (int32_t j = j0; j < std::min(kSide, j0 + h); ++j) {
        for (int32_t i = i0; i < std::min(kSide, i0 + w); ++i) set.push_back(i + kSide * j);
      }
      sets.push_back(set);
    }
    Pair pair = pair_of(block_body(kSide, kSide, 1), sets, sets);
    pair.before.tau = 5;
    pair.before.cap = 12;
    Numbers numbers = range(0, static_cast<int32_t>(sets.size()));
    for (int attempt = 0; attempt < 60; ++attempt) {
      const std::size_t s = random() % sets.size(), t = random() % sets.size();
      if (s == t || sets[s].size() >= 5) continue;
      std::vector<int32_t> both;
      std::set_union(sets[s].begin(), sets[s].end(), sets[t].begin(), sets[t].end(), std::back_inserter(both));
      bool touches = both.size() < sets[s].size() + sets[t].size();
      for (const int32_t a : sets[s]) {
        for (const int32_t b : sets[t]) {
          if (std::abs(a % kSide - b % kSide) + std::abs(a / kSide - b / kSide) == 1) touches = true;
        }
      }
      if (!touches || (both.size() > 12 && both.size() != sets[t].size())) continue;
      sets[t] = both;
      sets.erase(sets.begin() + static_cast<std::ptrdiff_t>(s));
      numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(s));
      ++merges;
    }
    set_clusters(pair.setup, pair.after, sets, numbers);
    const Verdict verdict = merge_legality(pair.setup, pair.before, pair.after);
    EXPECT_TRUE(verdict.holds) << "round " << round << ": " << verdict.witness.text;
    auto& set = sets[random() % sets.size()];
    const auto extra = static_cast<int32_t>(random() % (kSide * kSide));
    if (std::binary_search(set.begin(), set.end(), extra)) continue;
    set.insert(std::lower_bound(set.begin(), set.end(), extra), extra);
    set_clusters(pair.setup, pair.after, sets, numbers);
    noticed += merge_legality(pair.setup, pair.before, pair.after).holds ? 0 : 1;
  }
  EXPECT_GT(merges, 1000);
  EXPECT_GT(noticed, 100);  // not all: the extra particle may make another legal merge
}

// --- Where who was merged into whom has to be searched ---------------------------------------------------------------

// `results` clusters {0, 1} that each took in some of the vanished ones, whatever these are: they are all alike, so
// that trying all ways to deal them out takes longer than anybody waits.
Merge dealt_out(int32_t results, const Lists& vanished, const std::vector<int32_t>& result) {
  Lists before(static_cast<std::size_t>(results), {0, 1}), after(static_cast<std::size_t>(results), result);
  before.insert(before.end(), vanished.begin(), vanished.end());
  Merge merge(6, before, 3, 8);
  (void)merge.judge(after, range(0, results));
  return merge;
}

TEST(MergeLegality, DecidesThatThereAreTooFewOfACluster) {
  constexpr int32_t kResults = 9;
  const Merge enough = dealt_out(kResults, Lists(kResults, {1, 2}), {0, 1, 2});
  expect_holds(merge_legality(enough.pair.setup, enough.pair.before, enough.pair.after));
  const Merge short_of_one = dealt_out(kResults, Lists(kResults - 1, {1, 2}), {0, 1, 2});
  const Verdict verdict = merge_legality(short_of_one.pair.setup, short_of_one.pair.before, short_of_one.pair.after);
  expect_rejected(verdict, range(0, kResults), {});
  EXPECT_EQ(verdict.inconclusive, 0);
}

// Two of three kinds make a result. There are enough of each kind, and too few of all together.
TEST(MergeLegality, CountsWhatItCouldNotDecide) {
  constexpr int32_t kResults = 8;
  Lists vanished;
  for (int k = 0; k < 5; ++k) vanished.insert(vanished.end(), {{2, 3}, {3, 4}, {2, 4}});
  const Merge merge = dealt_out(kResults, vanished, {0, 1, 2, 3, 4});
  const Verdict verdict = merge_legality(merge.pair.setup, merge.pair.before, merge.pair.after);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.inconclusive, kResults);
}

TEST(MergeMaximality, RejectsASmallClusterThatSharesAParticleWithOneThatHasRoom) {
  Row row(8, {{0, 1, 2, 3}, {3, 4}, {4, 5, 6, 7}});
  row.state.tau = 3;
  row.state.cap = 5;
  const Verdict verdict = merge_maximality(row.setup, row.state);
  expect_rejected(verdict, {1, 0}, {3});
  EXPECT_EQ(verdict.checked, 1);
}

TEST(MergeMaximality, RejectsASmallClusterBesideOneThatHasRoom) {
  Row row(6, {{0, 1, 2, 3}, {4, 5}});
  row.state.tau = 3;
  row.state.cap = 6;
  expect_rejected(merge_maximality(row.setup, row.state), {1, 0}, {4, 3});
}

TEST(MergeMaximality, AcceptsWhereEveryUnionWouldExceedTheCap) {
  Row row(6, {{0, 1, 2, 3}, {4, 5}});
  row.state.tau = 3;
  row.state.cap = 5;
  const Verdict verdict = merge_maximality(row.setup, row.state);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 1);
}

TEST(MergeMaximality, RejectsAContainedSmallClusterWhateverTheCap) {
  Row row(6, {{0, 1, 2, 3, 4, 5}, {2, 3}});
  row.state.tau = 3;
  row.state.cap = 4;
  expect_rejected(merge_maximality(row.setup, row.state), {1, 0}, {2});
}

TEST(MergeMaximality, AcceptsASmallClusterThatTouchesNone) {
  Row row(6, {{0, 1, 2}, {4, 5}});
  remove_particles(row.state, {3});
  row.state.tau = 3;
  expect_holds(merge_maximality(row.setup, row.state));
}

TEST(MergeMaximality, CountsUnionsExactly) {
  // |s| + |t| = 7 > cap, but they share two particles.
  Row row(6, {{0, 1, 2, 3}, {2, 3, 4}});
  row.state.tau = 4;
  row.state.cap = 5;
  expect_rejected(merge_maximality(row.setup, row.state), {1, 0}, {2});
}

TEST(MergeMaximality, IsVacuousWhereTheRuleDoesNotPromiseIt) {
  Row row(6, {{0, 1, 2, 3}, {4, 5}});
  row.state.tau = 3;
  row.setup.merge.rule = MergeRule::none;
  const Verdict verdict = merge_maximality(row.setup, row.state);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 0);
}

TEST(JudgeStage, AsksForMaximalityAfterMerge) {
  Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
  const auto fails = [&](const char* property) {
    for (const Verdict& verdict : judge_stage(merge.pair.setup, Stage::merge, merge.pair.before, merge.pair.after,
                                              PropertyLists{&core_properties()})) {
      if (verdict.property == property) return !verdict.holds;
    }
    ADD_FAILURE() << property << " was not judged";
    return false;
  };
  (void)merge.judge({{0, 1, 2, 3}, {4, 5}}, {0, 1});
  EXPECT_TRUE(fails("merge maximality"));
  EXPECT_FALSE(fails("merge legality"));
  (void)merge.judge({range(0, 6)}, {0});
  EXPECT_FALSE(fails("merge maximality"));
}

}  // namespace
}  // namespace cutproof::oracles::merge_test
