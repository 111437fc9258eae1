// Merge against method.md §6. Expected results come from cases worked out by hand and from a second version of the
// deterministic rule, written down here sentence by sentence without regard for speed.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <random>
#include <tuple>

#include "reference_cpu/reference.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::merge_test {
namespace {

using namespace cutproof::tests;
using reference::merge_sets;
using reference::Merged;

struct Family {
  Body body;
  std::vector<uint8_t> alive;
  Lists sets;
  std::vector<int32_t> numbers;
};

Family family_of(Body body, Lists sets, std::vector<int32_t> numbers = {}) {
  Family family;
  family.alive.assign(body.node.size(), 1);
  family.body = std::move(body);
  if (numbers.empty()) numbers = range(0, static_cast<int32_t>(sets.size()));
  family.sets = std::move(sets);
  family.numbers = std::move(numbers);
  return family;
}

// Consecutive runs of particles of a wire, of the given lengths.
Family wire_family(const std::vector<int32_t>& lengths, std::vector<int32_t> numbers = {}) {
  Lists sets;
  int32_t next = 0;
  for (const int32_t length : lengths) {
    sets.push_back(range(next, next + length));
    next += length;
  }
  return family_of(block_body(next, 1, 1), sets, std::move(numbers));
}

Merged merged(const Family& f, MergeRule rule, int64_t tau, int64_t cap) {
  return merge_sets(f.body, f.alive, f.sets, f.numbers, rule, tau, cap);
}

// --- The rule, by brute force ------------------------------------------------------------------------------------

bool touch(const Family& f, const ParticleSet& a, const ParticleSet& b) {
  for (const int32_t p : a) {
    if (b.count(p) > 0) return true;
    for (const int32_t q : neighbours_of(f.body, p)) {
      if (f.alive[static_cast<std::size_t>(p)] && f.alive[static_cast<std::size_t>(q)] && b.count(q) > 0) return true;
    }
  }
  return false;
}

ParticleSet union_of(const ParticleSet& a, const ParticleSet& b) {
  ParticleSet both = a;
  both.insert(b.begin(), b.end());
  return both;
}

bool may_merge(const Family& f, const ParticleSet& s, const ParticleSet& t, int64_t cap) {
  if (!touch(f, s, t)) return false;
  const bool contained = union_of(s, t) == t;
  return contained || static_cast<int64_t>(union_of(s, t).size()) <= cap;
}

using ByNumber = std::map<int32_t, ParticleSet>;

std::optional<int32_t> preferred(const Family& f, const ByNumber& sets, int32_t s, int64_t cap) {
  std::optional<int32_t> best;
  for (const auto& [t, set] : sets) {
    if (t == s || !may_merge(f, sets.at(s), set, cap)) continue;
    if (!best || set.size() < sets.at(*best).size()) best = t;  // ascending numbers: ties keep the lower
  }
  return best;
}

uint32_t mix(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352d;
  x ^= x >> 15;
  x *= 0x846ca68b;
  x ^= x >> 16;
  return x;
}

struct BruteForce {
  ByNumber sets;
  int rounds = 0;
};

BruteForce deterministic_by_the_text(const Family& f, int64_t tau, int64_t cap) {
  using Key = std::tuple<uint32_t, int32_t, int32_t, int32_t>;
  BruteForce result;
  for (std::size_t k = 0; k < f.sets.size(); ++k) {
    result.sets[f.numbers[k]] = ParticleSet(f.sets[k].begin(), f.sets[k].end());
  }
  for (uint32_t r = 0;; ++r) {
    std::map<Key, std::pair<int32_t, int32_t>> proposals;
    for (const auto& [s, set] : result.sets) {
      if (static_cast<int64_t>(set.size()) >= tau) continue;
      const auto t = preferred(f, result.sets, s, cap);
      if (!t) continue;
      const auto low = static_cast<uint32_t>(std::min(s, *t)), high = static_cast<uint32_t>(std::max(s, *t));
      const uint32_t word = 0x9E3779B9u * low ^ 0x85EBCA6Bu * high ^ 0xC2B2AE35u * r;
      proposals[{mix(word), std::min(s, *t), std::max(s, *t), s}] = {s, *t};
    }
    if (proposals.empty()) return result;
    ++result.rounds;
    const auto is_least = [&](const Key& key, int32_t end) {
      for (const auto& [other, pair] : proposals) {  // ascending keys
        if (pair.first == end || pair.second == end) return other == key;
      }
      return false;
    };
    std::vector<std::pair<int32_t, int32_t>> carried_out;
    for (const auto& [key, pair] : proposals) {
      if (is_least(key, pair.first) && is_least(key, pair.second)) carried_out.push_back(pair);
    }
    for (const auto& [s, t] : carried_out) {
      result.sets[t] = union_of(result.sets[s], result.sets[t]);
      result.sets.erase(s);
    }
  }
}

ByNumber by_number(const Family& f, const Merged& result) {
  ByNumber sets;
  for (std::size_t k = 0; k < result.sets.size(); ++k) {
    sets[f.numbers[static_cast<std::size_t>(result.survivor[k])]] =
        ParticleSet(result.sets[k].begin(), result.sets[k].end());
  }
  return sets;
}

Family random_family(std::mt19937& random) {
  Family f = family_of({}, {});
  f.body = random_body(random, {5, 4, 4}, 0.85);
  f.alive.assign(f.body.node.size(), 1);
  f.sets = random_cover(random, f.body, draw(random, 2, 14));
  f.numbers.clear();
  int32_t number = 0;
  for (std::size_t k = 0; k < f.sets.size(); ++k) f.numbers.push_back(number += draw(random, 1, 5));
  return f;
}

// --- Which pairs may merge ---------------------------------------------------------------------------------------

TEST(MergeSets, JoinsASmallSetToTheSmallestSetThatItTouches) {
  const auto f = wire_family({6, 2, 5, 7});
  const Merged result = merged(f, MergeRule::deterministic, 3, 20);
  EXPECT_EQ(result.sets, (Lists{range(0, 6), range(6, 13), range(13, 20)}));
  EXPECT_EQ(result.survivor, (std::vector<int32_t>{0, 2, 3}));
}

TEST(MergeSets, BreaksTiesOfSizeByTheLowestNumber) {
  const auto f = wire_family({5, 2, 5}, {7, 3, 4});
  const Merged result = merged(f, MergeRule::deterministic, 3, 20);
  EXPECT_EQ(result.sets, (Lists{range(5, 12), range(0, 5)})) << "sets come in the order of numbers 4, 7";
  EXPECT_EQ(result.survivor, (std::vector<int32_t>{2, 0}));
}

TEST(MergeSets, LeavesASetOfTauParticlesAlone) {
  EXPECT_EQ(merged(wire_family({3, 5}), MergeRule::deterministic, 3, 20).sets.size(), 2u);
  EXPECT_EQ(merged(wire_family({2, 5}), MergeRule::deterministic, 3, 20).sets.size(), 1u);
}

TEST(MergeSets, MayFillCapExactlyButNotExceedIt) {
  EXPECT_EQ(merged(wire_family({2, 5}), MergeRule::deterministic, 3, 7).sets.size(), 1u);
  EXPECT_EQ(merged(wire_family({2, 5}), MergeRule::deterministic, 3, 6).sets.size(), 2u);
}

TEST(MergeSets, CountsSharedParticlesOfAUnionOnce) {
  const auto f = family_of(block_body(7, 1, 1), {{0, 1, 2}, {1, 2, 3, 4, 5, 6}});
  EXPECT_EQ(merged(f, MergeRule::deterministic, 4, 7).sets, (Lists{range(0, 7)}));
  EXPECT_EQ(merged(f, MergeRule::deterministic, 4, 6).sets.size(), 2u);
}

TEST(MergeSets, TakesTheSecondChoiceWhenTheFirstWouldExceedCap) {
  // The smallest set that touches 1 is 0, but together they have 8 particles; with 2, which holds three of its four,
  // it has 6.
  const auto f = family_of(block_body(10, 1, 1), {range(0, 4), range(4, 8), range(5, 10)});
  EXPECT_EQ(merged(f, MergeRule::deterministic, 5, 6).sets, (Lists{range(0, 4), range(4, 10)}));
}

TEST(MergeSets, AlwaysTakesInAContainedSetWhateverCapSays) {
  const auto f = family_of(block_body(8, 1, 1), {range(0, 8), {3, 4}});
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    EXPECT_EQ(merged(f, rule, 3, 1).sets, (Lists{range(0, 8)}));
  }
}

TEST(MergeSets, JoinsTwoEqualSetsIntoOne) {
  const auto f = family_of(block_body(3, 1, 1), {{0, 1, 2}, {0, 1, 2}});
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    EXPECT_EQ(merged(f, rule, 4, 1).sets, (Lists{{0, 1, 2}}));
  }
}

TEST(MergeSets, DoesNotCallDiagonalNeighboursTouching) {
  const auto f = family_of(body_of({{0, 0, 0}, {1, 1, 0}, {1, 1, 1}, {2, 2, 2}}), {{0}, {1, 2}, {3}});
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    EXPECT_EQ(merged(f, rule, 10, 10).sets.size(), 3u);
  }
}

TEST(MergeSets, DoesNotReachAcrossACut) {
  auto f = family_of(block_body(5, 1, 1), {{0, 1}, {3, 4}});
  f.alive[2] = 0;
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    EXPECT_EQ(merged(f, rule, 10, 10).sets.size(), 2u);
  }
}

TEST(MergeSets, ReturnsAFamilyWithoutSmallSetsAsItIs) {
  const auto f = wire_family({4, 4, 4});
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    const Merged result = merged(f, rule, 4, 100);
    EXPECT_EQ(result.sets, f.sets);
    EXPECT_EQ(result.survivor, (std::vector<int32_t>{0, 1, 2}));
  }
}

TEST(MergeSets, AcceptsAnEmptyFamily) {
  const auto f = family_of(body_of({}), {});
  for (const auto rule : {MergeRule::deterministic, MergeRule::published}) {
    EXPECT_TRUE(merged(f, rule, 4, 100).sets.empty());
  }
}

// --- The deterministic rule --------------------------------------------------------------------------------------

TEST(DeterministicMerge, IsWhatTheTextSaysOnRandomFamilies) {
  constexpr uint32_t kSeed = 611;
  std::mt19937 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  int64_t joins = 0;
  for (int round = 0; round < 300; ++round) {
    const Family f = random_family(random);
    const int64_t tau = draw(random, 1, 12), cap = draw(random, 1, 30);
    const Merged result = merged(f, MergeRule::deterministic, tau, cap);
    ASSERT_EQ(by_number(f, result), deterministic_by_the_text(f, tau, cap).sets)
        << "seed " << kSeed << ", round " << round << ", tau " << tau << ", cap " << cap;
    joins += static_cast<int64_t>(f.sets.size() - result.sets.size());
  }
  EXPECT_GT(joins, 300);
}

TEST(DeterministicMerge, NeedsThreeRoundsForAChainOfAThousand) {
  const auto f = wire_family(std::vector<int32_t>(1000, 1));
  // Pairs at most, so that only keys decide who pairs with whom.
  const BruteForce expected = deterministic_by_the_text(f, 2, 2);
  EXPECT_EQ(expected.rounds, 3);
  EXPECT_EQ(by_number(f, merged(f, MergeRule::deterministic, 2, 2)), expected.sets);
}

TEST(DeterministicMerge, DoesNotDependOnTheOrderInWhichTheSetsAreGiven) {
  constexpr uint32_t kSeed = 17;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 50; ++round) {
    const Family f = random_family(random);
    Family g = f;
    std::vector<int32_t> order = range(0, static_cast<int32_t>(f.sets.size()));
    std::shuffle(order.begin(), order.end(), random);
    for (std::size_t k = 0; k < order.size(); ++k) {
      g.sets[k] = f.sets[static_cast<std::size_t>(order[k])];
      g.numbers[k] = f.numbers[static_cast<std::size_t>(order[k])];
    }
    ASSERT_EQ(by_number(f, merged(f, MergeRule::deterministic, 8, 20)),
              by_number(g, merged(g, MergeRule::deterministic, 8, 20)));
  }
}

// --- Legal and maximal -------------------------------------------------------------------------------------------

class LegalMerge : public ::testing::TestWithParam<MergeRule> {};

TEST_P(LegalMerge, GivesUnionsOfTouchingSetsAndStopsOnlyWhenNoSmallSetCouldMerge) {
  constexpr uint32_t kSeed = 88;
  std::mt19937 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  for (int round = 0; round < 200; ++round) {
    const Family f = random_family(random);
    const int64_t tau = draw(random, 1, 12), cap = draw(random, 1, 30);
    const Merged result = merged(f, GetParam(), tau, cap);
    const ByNumber sets = by_number(f, result);
    ASSERT_TRUE(std::is_sorted(result.survivor.begin(), result.survivor.end())) << "numbers ascend with the input here";

    // Nothing is lost: every particle keeps a set. Nothing is made up: a result is its survivor with whole sets of
    // the input, connected, and at most cap unless one of the inputs contains all of it.
    ParticleSet all;
    for (const auto& [number, set] : sets) {
      all.insert(set.begin(), set.end());
      ASSERT_TRUE(is_connected(f.body, {set.begin(), set.end()}));
      ParticleSet inside;
      bool is_an_input = false;
      for (const auto& input : f.sets) {
        if (std::includes(set.begin(), set.end(), input.begin(), input.end()))
          inside.insert(input.begin(), input.end());
        is_an_input = is_an_input || std::equal(set.begin(), set.end(), input.begin(), input.end());
      }
      ASSERT_EQ(inside, set);
      ASSERT_TRUE(is_an_input || static_cast<int64_t>(set.size()) <= cap);
      if (static_cast<int64_t>(set.size()) < tau) {
        ASSERT_EQ(preferred(f, sets, number, cap), std::nullopt) << "seed " << kSeed << ", round " << round;
      }
    }
    ASSERT_EQ(static_cast<int32_t>(all.size()), f.body.particle_count());
  }
}

INSTANTIATE_TEST_SUITE_P(Rules, LegalMerge, ::testing::Values(MergeRule::deterministic, MergeRule::published),
                         [](const auto& tested) {
                           return tested.param == MergeRule::deterministic ? "Deterministic" : "Published";
                         });

TEST(PublishedMerge, ClaimsInTheOrderOfNumbersWithRolesLocked) {
  // 0 claims 1. So 1 may not claim; 2 prefers 1, which is taken, and waits; 3 prefers 2 and claims it. In the next
  // pass nobody is small any more.
  const auto f = wire_family({1, 1, 1, 1});
  const Merged result = merged(f, MergeRule::published, 2, 10);
  EXPECT_EQ(result.sets, (Lists{{0, 1}, {2, 3}}));
  EXPECT_EQ(result.survivor, (std::vector<int32_t>{1, 2}));
}

// --- The stage ---------------------------------------------------------------------------------------------------

TEST(Merge, LeavesRotationFlagAndNumberOfTheTargetEvenIfItsNumberIsHigher) {
  const auto setup = setup_of(block_body(9, 1, 1));
  State state = state_of(setup.body, {range(0, 2), range(2, 5), range(5, 9)}, 3, 9);
  state.clusters.number = {2, 5, 7};
  state.clusters.rotation[1] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  state.clusters.degenerate[1] = 1;
  const Clusters before = state.clusters;
  reference::merge(setup, state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{range(0, 5), range(5, 9)}));
  EXPECT_EQ(state.clusters.number, (std::vector<int32_t>{5, 7}));
  EXPECT_EQ(state.clusters.rotation, (std::vector<Mat3>{before.rotation[1], before.rotation[2]}));
  EXPECT_EQ(state.clusters.degenerate, (std::vector<uint8_t>{1, 0}));
}

TEST(Merge, RecomputesTheRestFramesOfNeighboursWhoseParticlesAreSharedLess) {
  // Particle 2 lies in all three clusters; merging the first two changes n_2 and so the frame of the third.
  const auto setup = setup_of(block_body(6, 1, 1));
  State state = state_of(setup.body, {{0, 1, 2}, {1, 2}, {2, 3, 4, 5}}, 3, 4);
  reference::merge(setup, state);
  ASSERT_EQ(lists_of(state.clusters), (Lists{{0, 1, 2}, {2, 3, 4, 5}}));
  EXPECT_DOUBLE_EQ(state.clusters.mass[1], 3.5);
  EXPECT_DOUBLE_EQ(state.clusters.rest_center[1].x, (0.5 * 3 + 4 + 5 + 6) / 3.5);
}

TEST(Merge, DoesNothingUnderTheRuleNone) {
  auto setup = setup_of(block_body(4, 1, 1));
  setup.merge.rule = MergeRule::none;
  State state = state_of(setup.body, {{0}, {1}, {2}, {3}}, 100, 100);
  const State before = state;
  reference::merge(setup, state);
  EXPECT_EQ(state, before);
}

TEST(Merge, KeepsEdgesCovered) {
  constexpr uint32_t kSeed = 5;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 100; ++round) {
    const Body body = random_body(random, {4, 4, 4}, 0.8);
    const auto setup = setup_of(body);
    Lists lists = random_cover(random, body, 10);
    for (int32_t p = 0; p < body.particle_count(); ++p) {
      for (const int32_t q : neighbours_of(body, p)) {
        if (p < q) lists.push_back({p, q});
      }
    }
    State state = state_of(body, lists, 6, 30);
    ASSERT_EQ(uncovered_edges(body, state.alive, lists), 0);
    reference::merge(setup, state);
    ASSERT_LT(state.clusters.count(), static_cast<int32_t>(lists.size()));
    ASSERT_EQ(uncovered_edges(body, state.alive, lists_of(state.clusters)), 0);
  }
}

}  // namespace
}  // namespace cutproof::merge_test
