// Stage merge of the kernels, executed on the host: equal to the reference under `deterministic`, legal and maximal in
// every schedule under `published` (method.md §6).
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "fixtures/cook.h"
#include "gpu/kernels/merge.cuh"
#include "oracles/oracles.h"
#include "tests/gpu/kernels/cluster_stages.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::gpu::merge_kernel_test {
namespace {

using namespace cutproof::gpu::tests;
using namespace cutproof::tests;

void merge_on(HostLauncher& launcher, Bench& bench) {
  bench.spoil_scratch();
  enqueue_merge(launcher, bench.view);
}

State reference_merge(const Setup& setup, State state) {
  reference::merge(setup, state);
  return state;
}

void expect_equal_to_reference(HostLauncher& launcher, Bodies bodies, bool cut) {
  Bench bench(std::move(bodies), cut);
  merge_on(launcher, bench);
  ASSERT_EQ(bench.fault(), 0);
  expect_memberships_agree(bench.staging);
  const std::vector<State> after = bench.states();
  for (std::size_t b = 0; b < after.size(); ++b) {
    const cutproof::Setup& setup = bench.bodies.setups[b];
    const State& before = bench.bodies.states[b];
    const bool merges = cut || !before.removed.empty();
    const State expected = merges ? reference_merge(setup, before) : before;
    SCOPED_TRACE("body " + std::to_string(b));
    expect_same_clusters(expected, after[b], setup.body.grid.spacing);
    if (::testing::Test::HasFatalFailure()) return;
  }
  for (const unsigned char dirty : bench.staging.rest_dirty) ASSERT_EQ(dirty, 0);
}

Bodies one(Setup setup, State state) {
  Bodies bodies;
  bodies.add(std::move(setup), std::move(state));
  return bodies;
}
Setup setup_with(Body body, MergeRule rule) {
  Setup setup = setup_of(std::move(body));
  setup.merge.rule = rule;
  return setup;
}
// Rotations that are all different, so that a merge that gives a cluster the wrong one is seen.
State told_apart(State state) {
  for (std::size_t c = 0; c < state.clusters.number.size(); ++c) {
    const double angle = 0.01 * static_cast<double>(c);
    state.clusters.rotation[c] = {{std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1}};
    state.clusters.degenerate[c] = c % 3 == 1;
  }
  return state;
}
Bodies hand_made(Body body, const Lists& lists, int32_t tau, int32_t cap, MergeRule rule = MergeRule::deterministic) {
  State state = told_apart(state_of(body, lists, tau, cap));
  return one(setup_with(std::move(body), rule), std::move(state));
}

// A wire of consecutive clusters of the given lengths.
Bodies wire(const std::vector<int32_t>& lengths, int32_t tau, int32_t cap, MergeRule rule = MergeRule::deterministic) {
  Lists lists;
  int32_t next = 0;
  for (const int32_t length : lengths) {
    lists.push_back(range(next, next + length));
    next += length;
  }
  return hand_made(block_body(next, 1, 1), lists, tau, cap, rule);
}

Bodies random_foreign(std::uint32_t seed, MergeRule rule) {
  std::mt19937 random(seed);
  const Node size = {draw(random, 2, 7), draw(random, 2, 6), draw(random, 1, 5)};
  Body body = random_body(random, size, 0.9);
  const int32_t most = draw(random, 1, 12);
  const Lists lists = random_cover(random, body, most);
  return hand_made(std::move(body), lists, draw(random, 1, most + 2), draw(random, most / 2, 3 * most), rule);
}

// Runs a merge under many schedules of several kinds.
void for_schedules(int count, const std::function<void(HostLauncher&)>& run) {
  for (int k = 0; k < count; ++k) {
    const auto seed = static_cast<std::uint64_t>(k);
    SCOPED_TRACE("schedule " + std::to_string(k));
    Generator schedule = k == 0   ? forward()
                         : k == 1 ? reverse()
                         : k == 2 ? round_robin()
                         : k % 3  ? random_walk(seed)
                                  : pct(seed, 1 + k / 3 % 4, 4000);
    HostLauncher::Simulated options{.schedule = std::move(schedule)};
    options.live_blocks = 2 + k % 7;
    HostLauncher launcher(std::move(options));
    run(launcher);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(GpuMerge, EqualsTheReferenceOnRandomDissections) {
  HostLauncher launcher(HostLauncher::Threads{2});
  int merged = 0;
  for_random_states(11, 350, 45, Stage::merge, [&](const cutproof::Setup& given, const State& state) {
    cutproof::Setup setup = given;
    setup.merge.rule = MergeRule::deterministic;
    merged += reference_merge(setup, state).clusters.count() < state.clusters.count();
    expect_equal_to_reference(launcher, one(setup, state), false);
  });
  EXPECT_GT(merged, 40);
}

TEST(GpuMerge, EqualsTheReferenceOnForeignClusters) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (std::uint32_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE("random_foreign(" + std::to_string(seed) + ')');
    expect_equal_to_reference(launcher, random_foreign(seed, MergeRule::deterministic), true);
  }
}

TEST(GpuMerge, EqualsTheReferenceInEverySchedule) {
  for (std::uint32_t seed = 1000; seed < 1003; ++seed) {
    for_schedules(60, [&](HostLauncher& launcher) {
      expect_equal_to_reference(launcher, random_foreign(seed, MergeRule::deterministic), true);
    });
  }
}

TEST(GpuMerge, AChainOfAThousandClustersEqualsTheReference) {
  HostLauncher launcher(HostLauncher::Threads{2});
  expect_equal_to_reference(launcher, wire(std::vector<int32_t>(1000, 2), 3, 4), true);
  expect_equal_to_reference(launcher, wire(std::vector<int32_t>(1000, 2), 3, 6), true);
}

TEST(GpuMerge, AmongEqualTargetsTheLowestNumberIsTaken) {
  // 0 and 2 are equal neighbours of the small cluster 1.
  Bench bench(wire({3, 1, 3}, 2, 10), true);
  HostLauncher launcher;
  merge_on(launcher, bench);
  const State after = bench.states().front();
  EXPECT_EQ(after.clusters.number, (std::vector<int32_t>{0, 2}));
  EXPECT_EQ(lists_of(after.clusters), (Lists{range(0, 4), range(4, 7)}));
}

TEST(GpuMerge, TheSmallestTargetIsTakenThoughItsNumberIsHigher) {
  Bench bench(wire({4, 1, 3}, 2, 10), true);
  HostLauncher launcher;
  merge_on(launcher, bench);
  EXPECT_EQ(lists_of(bench.states().front().clusters), (Lists{range(0, 4), range(4, 8)}));
}

TEST(GpuMerge, ACapThatIsMetExactlyAllowsAMergeAndOneLessDoesNot) {
  HostLauncher launcher;
  for (const int32_t cap : {5, 4}) {
    Bench bench(wire({4, 1}, 2, cap), true);
    merge_on(launcher, bench);
    EXPECT_EQ(bench.states().front().clusters.count(), cap == 5 ? 1 : 2);
  }
}

TEST(GpuMerge, AContainedClusterMergesAboveTheCap) {
  // 1 lies inside 0, which is larger than the cap; 2 overlaps 0 but does not.
  Body body = block_body(9, 1, 1);
  Bench bench(hand_made(body, {range(0, 8), range(3, 5), range(7, 9)}, 3, 4), true);
  const int members_before = bench.staging.counters.front().members_used;
  HostLauncher launcher;
  merge_on(launcher, bench);
  EXPECT_EQ(lists_of(bench.states().front().clusters), (Lists{range(0, 8), range(7, 9)}));
  EXPECT_EQ(bench.staging.counters.front().members_used, members_before) << "a contained cluster needs no new places";
  expect_memberships_agree(bench.staging);
}

TEST(GpuMerge, EqualClustersBecomeOne) {
  HostLauncher launcher;
  expect_equal_to_reference(launcher, hand_made(block_body(4, 1, 1), {range(0, 4), range(0, 4), range(0, 4)}, 5, 1),
                            true);
}

TEST(GpuMerge, ClustersApartDoNotMerge) {
  // Two pieces of wire, and one small cluster that only a dead particle joins to another.
  Body body = block_body(7, 1, 1);
  Bodies bodies = hand_made(body, {range(0, 2), range(3, 5), range(5, 7)}, 3, 3);
  remove_particles(bodies.states[0], {2});
  Bench bench(std::move(bodies));
  HostLauncher launcher;
  merge_on(launcher, bench);
  EXPECT_EQ(bench.states().front().clusters.count(), 3);
}

TEST(GpuMerge, RestFramesOfEveryClusterThatSharesAParticleAreRecomputed) {
  // 0 and 1 share particle 2, 2 shares it too but does not merge.
  Body body = block_body(8, 1, 1);
  expect_equal_to_reference(*std::make_unique<HostLauncher>(),
                            hand_made(body, {range(0, 3), range(2, 4), range(2, 8)}, 3, 4), true);
}

// Slot 0 alone is small, touches 600 clusters, and may join only one of them: all the others are the same, and too
// large by one. They do not fit into the table of candidates, whose first window is slots 1 to 512.
TEST(GpuMerge, TheOneLegalTargetIsFoundInAnyPlaceOfAWindowOfCandidates) {
  HostLauncher launcher;
  const Body body = block_body(41, 1, 1);
  for (const std::size_t place : {1, 2, 511, 512, 513, 514, 599, 600}) {
    SCOPED_TRACE("target in slot " + std::to_string(place));
    Lists lists(601, range(19, 41));
    lists[0] = range(0, 20);
    lists[place] = range(19, 40);
    Bodies bodies = hand_made(body, lists, 21, 40);
    ASSERT_EQ(reference_merge(bodies.setups[0], bodies.states[0]).clusters.count(), 600);
    expect_equal_to_reference(launcher, std::move(bodies), true);
  }
}

// One cluster touches more clusters than the table of candidates holds, and may join only one of them.
TEST(GpuMerge, AClusterThatTouchesAThousandOthersFindsItsTarget) {
  HostLauncher launcher(HostLauncher::Threads{2});
  const Body body = block_body(30, 30, 2);
  for (const int32_t single : {901, 950, 1003, 1111, 1234, 1313, 1499, 1600, 1750, 1799}) {
    SCOPED_TRACE("single particle " + std::to_string(single));
    Lists lists = {range(0, 900)};
    for (int32_t p = 901; p < 1800; ++p) lists.push_back(p == single ? range(p, p + 1) : range(p - 1, p + 1));
    expect_equal_to_reference(launcher, hand_made(body, lists, 901, 901), true);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
}

// A round lets one in, so the target is named in round after round.
TEST(GpuMerge, ManyClustersThatWaitForOneTargetComeInOneByOne) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (const int32_t cap : {40, 1000}) {
    for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
      // A floor of 36, and on every second node of it a post of two.
      std::vector<Node> nodes;
      for (int32_t j = 0; j < 6; ++j) {
        for (int32_t i = 0; i < 6; ++i) nodes.push_back({i, j, 0});
      }
      Lists lists = {range(0, 36)};
      for (int32_t k = 1; k <= 2; ++k) {
        for (int32_t j = 0; j < 6; ++j) {
          for (int32_t i = j % 2; i < 6; i += 2) nodes.push_back({i, j, k});
        }
      }
      for (int32_t post = 36; post < 54; ++post) lists.push_back({post, post + 18});
      Bench bench(hand_made(body_of(nodes), lists, 3, cap, rule), true);
      merge_on(launcher, bench);
      expect_memberships_agree(bench.staging);
      const State after = bench.states().front();
      EXPECT_EQ(after.clusters.count(), cap == 40 ? 17 : 1);
      if (rule == MergeRule::deterministic) {
        const cutproof::Setup& setup = bench.bodies.setups.front();
        expect_same_clusters(reference_merge(setup, bench.bodies.states.front()), after, 1);
      }
    }
  }
}

TEST(GpuMerge, PublishedIsLegalAndMaximalInEverySchedule) {
  std::uint32_t seed = 0;
  int fewer = 0;
  for_schedules(240, [&](HostLauncher& launcher) {
    Bench bench(random_foreign(++seed % 40, MergeRule::published), true);
    merge_on(launcher, bench);
    ASSERT_EQ(bench.fault(), 0);
    expect_memberships_agree(bench.staging);
    const cutproof::Setup& setup = bench.bodies.setups.front();
    const State& before = bench.loaded.front();
    const State after = bench.states().front();
    fewer += after.clusters.count() < before.clusters.count();
    for (const Verdict& verdict : {oracles::merge_legality(setup, before, after),
                                   oracles::cap_kept(setup, before, after), oracles::merge_maximality(setup, after)}) {
      ASSERT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
    }
    State expected = after;
    reference::update_rest_frames(setup.body, expected.clusters);
    expect_same_clusters(expected, after, setup.body.grid.spacing);
  });
  EXPECT_GT(fewer, 100);
}

TEST(GpuMerge, PublishedOnRandomDissectionsIsLegalAndMaximal) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for_random_states(12, 60, 45, Stage::merge, [&](const cutproof::Setup& given, const State& state) {
    cutproof::Setup setup = given;
    setup.merge.rule = MergeRule::published;
    Bench bench(one(setup, state));
    merge_on(launcher, bench);
    const State after = bench.states().front();
    for (const Verdict& verdict :
         {oracles::merge_legality(setup, bench.loaded.front(), after),
          oracles::cap_kept(setup, bench.loaded.front(), after), oracles::merge_maximality(setup, after)}) {
      ASSERT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
    }
  });
}

TEST(GpuMerge, PublishedMergesAChainOfAThousandClusters) {
  for_schedules(6, [&](HostLauncher& launcher) {
    Bench bench(wire(std::vector<int32_t>(1000, 2), 3, 6, MergeRule::published), true);
    merge_on(launcher, bench);
    const State after = bench.states().front();
    const cutproof::Setup& setup = bench.bodies.setups.front();
    EXPECT_TRUE(oracles::merge_legality(setup, bench.loaded.front(), after).holds);
    EXPECT_TRUE(oracles::cap_kept(setup, bench.loaded.front(), after).holds);
    EXPECT_TRUE(oracles::merge_maximality(setup, after).holds);
  });
}

TEST(GpuMerge, BodiesOfOneLoadKeepTheirOwnRules) {
  HostLauncher launcher(HostLauncher::Threads{2});
  const auto judge = [&](std::uint32_t seed) {
    Bodies bodies;
    const auto add = [&](Bodies more) { bodies.add(more.setups.front(), more.states.front()); };
    for (std::uint32_t k = 0; k < 12; ++k) {
      add(random_foreign(seed + k, std::array{MergeRule::deterministic, MergeRule::published, MergeRule::none}[k % 3]));
      if (k % 4 != 0 && !bodies.states.back().x.empty()) {  // one in four was not cut
        // A particle that no cluster holds dies.
        State& state = bodies.states.back();
        Lists lists = lists_of(state.clusters);
        for (auto& list : lists) std::erase(list, 0);
        std::erase_if(lists, [](const auto& list) { return list.empty(); });
        state.clusters = clusters_of(bodies.setups.back().body, lists);
        remove_particles(state, {0});
      }
    }
    Bench bench(bodies);
    merge_on(launcher, bench);
    ASSERT_EQ(bench.fault(), 0);
    expect_memberships_agree(bench.staging);
    const std::vector<State> after = bench.states();
    for (std::size_t b = 0; b < after.size(); ++b) {
      SCOPED_TRACE("body " + std::to_string(b));
      const State& before = bench.loaded[b];
      const cutproof::Setup& setup = bodies.setups[b];
      if (setup.merge.rule == MergeRule::published && !before.removed.empty()) {
        ASSERT_TRUE(oracles::merge_legality(setup, before, after[b]).holds);
        ASSERT_TRUE(oracles::cap_kept(setup, before, after[b]).holds);
        ASSERT_TRUE(oracles::merge_maximality(setup, after[b]).holds);
      } else {
        const State expected = before.removed.empty() ? before : reference_merge(setup, before);
        expect_same_clusters(expected, after[b], setup.body.grid.spacing);
      }
      if (::testing::Test::HasFatalFailure()) return;
    }
  };
  for (std::uint32_t seed = 0; seed < 300; seed += 12) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    judge(seed);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

// A capacity for all lists twice is enough for any merge; it is used up in the middle of rounds, again and again.
TEST(GpuMerge, WhenRoomIsUsedUpListsAreMovedTogetherAndNothingElseChanges) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
      SCOPED_TRACE("random_foreign(" + std::to_string(seed) + ')');
      Bodies bodies = seed == 0 ? wire(std::vector<int32_t>(300, 2), 11, 12, rule) : random_foreign(seed, rule);
      Bench bench(bodies, true);
      const int used = bench.staging.counters.front().members_used;
      bench.staging.member_capacity = 2 * used;
      bench.staging.allocate();
      bench.view = bench.staging.view();
      merge_on(launcher, bench);
      ASSERT_EQ(bench.fault(), 0);
      ASSERT_LE(bench.staging.counters.front().members_used, 2 * used);
      expect_memberships_agree(bench.staging);
      const cutproof::Setup& setup = bodies.setups.front();
      const State after = bench.states().front();
      if (rule == MergeRule::deterministic) {
        expect_same_clusters(reference_merge(setup, bodies.states.front()), after, setup.body.grid.spacing);
      } else {
        ASSERT_TRUE(oracles::merge_legality(setup, bench.loaded.front(), after).holds);
        ASSERT_TRUE(oracles::cap_kept(setup, bench.loaded.front(), after).holds);
        ASSERT_TRUE(oracles::merge_maximality(setup, after).holds);
      }
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
    }
  }
}

TEST(GpuMerge, WithoutRoomForItsUnionsAMergeIsFlaggedAndChangesNothing) {
  HostLauncher launcher;
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
    for (const int spare : {0, 1, 100, 199}) {
      Bench bench(wire(std::vector<int32_t>(100, 2), 5, 12, rule), true);
      const int used = bench.staging.counters.front().members_used;
      bench.staging.member_capacity = used + spare;
      bench.staging.allocate();
      bench.view = bench.staging.view();
      merge_on(launcher, bench);
      EXPECT_EQ(bench.fault(), kMembersFull);
      EXPECT_EQ(bench.states(), bench.loaded);
      EXPECT_EQ(bench.staging.counters.front().members_used, used);
      expect_memberships_agree(bench.staging);
      for (const unsigned char dirty : bench.staging.rest_dirty) EXPECT_EQ(dirty, 0);
    }
  }
  // One small cluster needs no more than its union.
  Bench bench(wire({8, 1, 8}, 2, 9), true);
  bench.staging.member_capacity = 17 + 9;
  bench.staging.allocate();
  bench.view = bench.staging.view();
  merge_on(launcher, bench);
  EXPECT_EQ(bench.fault(), 0);
  EXPECT_EQ(bench.states().front().clusters.count(), 2);
}

TEST(GpuMerge, AfterAFaultOfAnEarlierStageNothingMerges) {
  Bench bench(wire({2, 2, 2}, 3, 12), true);
  bench.staging.counters.front().fault = kSlotsFull;
  const std::vector<State> before = bench.states();
  HostLauncher launcher;
  merge_on(launcher, bench);
  EXPECT_EQ(bench.states(), before);
}

TEST(GpuMerge, ALoadWithoutBodiesOrClustersIsLeftAlone) {
  HostLauncher launcher;
  Bench empty((Bodies()));
  merge_on(launcher, empty);
  Bench no_particles(hand_made(body_of({}), {}, 3, 3), true);
  merge_on(launcher, no_particles);
  EXPECT_EQ(empty.fault() | no_particles.fault(), 0);
}

}  // namespace
}  // namespace cutproof::gpu::merge_kernel_test
