// Stage expand of the kernels, executed on the host: equal to the reference (method.md §7).
#include <gtest/gtest.h>

#include <random>

#include "gpu/kernels/expand.cuh"
#include "oracles/oracles.h"
#include "tests/gpu/kernels/cluster_stages.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::gpu::expand_kernel_test {
namespace {

using namespace cutproof::gpu::tests;
using namespace cutproof::tests;

void expand_on(HostLauncher& launcher, Bench& bench) {
  bench.spoil_scratch();
  enqueue_expand(launcher, bench.view, bench.plan);
}

// What the reference's backend does with a state whose frame is at this stage.
State reference_expand(const Setup& setup, State state, bool cut) {
  if (cut && (setup.expand.rule == ExpandRule::published || !state.edge_covered)) reference::expand(setup, state);
  return state;
}

void expect_equal_to_reference(HostLauncher& launcher, Bodies bodies, bool cut) {
  Bench bench(std::move(bodies), cut);
  expand_on(launcher, bench);
  ASSERT_EQ(bench.fault(), 0);
  expect_memberships_agree(bench.staging);
  const std::vector<State> after = bench.states();
  for (std::size_t b = 0; b < after.size(); ++b) {
    const Setup& setup = bench.bodies.setups[b];
    const State& before = bench.bodies.states[b];
    SCOPED_TRACE("body " + std::to_string(b));
    expect_same_clusters(reference_expand(setup, before, cut || !before.removed.empty()), after[b],
                         setup.body.grid.spacing);
    if (::testing::Test::HasFatalFailure()) return;
  }
  for (const unsigned char dirty : bench.staging.rest_dirty) ASSERT_EQ(dirty, 0);
}

Bodies hand_made(Body body, const Lists& lists, ExpandParameters expand) {
  Bodies bodies;
  State state = state_of(body, lists);
  Setup setup = setup_of(std::move(body));
  setup.expand = expand;
  bodies.add(std::move(setup), std::move(state));
  return bodies;
}
constexpr ExpandParameters kCover = {ExpandRule::edge_cover, 1};

Bodies random_foreign(std::uint32_t seed, ExpandParameters expand) {
  std::mt19937 random(seed);
  const Node size = {draw(random, 1, 7), draw(random, 1, 6), draw(random, 1, 5)};
  Body body = random_body(random, size, 0.9);
  const Lists lists = random_cover(random, body, draw(random, 1, 12));
  return hand_made(std::move(body), lists, expand);
}
ExpandParameters parameters(std::uint32_t k) {
  return {k % 2 == 0 ? ExpandRule::edge_cover : ExpandRule::published, 1 + static_cast<int32_t>(k / 2 % 4)};
}

TEST(GpuExpand, EqualsTheReferenceOnRandomDissections) {
  HostLauncher launcher(HostLauncher::Threads{2});
  std::uint32_t k = 0;
  int grown = 0;
  for_random_states(21, 1200, 45, Stage::expand, [&](const cutproof::Setup& given, const State& state) {
    cutproof::Setup setup = given;
    setup.expand = parameters(k++);
    Bodies bodies;
    bodies.add(setup, state);
    // Cooked clusters are covered already; asked again, kernels and reference must both find nothing to add.
    bodies.states.back().edge_covered = k % 3 == 0;
    const State expected = reference_expand(setup, bodies.states.back(), true);
    grown += expected.clusters.members.size() > state.clusters.members.size();
    expect_equal_to_reference(launcher, std::move(bodies), false);
  });
  EXPECT_GT(grown, 20);
}

TEST(GpuExpand, EqualsTheReferenceOnForeignClustersAtEveryDepth) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (std::uint32_t seed = 1; seed <= 160; ++seed) {
    SCOPED_TRACE("random_foreign(" + std::to_string(seed) + ')');
    expect_equal_to_reference(launcher, random_foreign(seed, parameters(seed)), true);
  }
}

TEST(GpuExpand, EqualsTheReferenceInEverySchedule) {
  for (int k = 0; k < 200; ++k) {
    SCOPED_TRACE("schedule " + std::to_string(k));
    const auto seed = static_cast<std::uint64_t>(k);
    HostLauncher::Simulated options{.schedule = k == 0   ? forward()
                                                : k == 1 ? reverse()
                                                : k % 3  ? random_walk(seed)
                                                         : pct(seed, 1 + k / 3 % 4, 2000)};
    options.live_blocks = 2 + k % 7;
    HostLauncher launcher(std::move(options));
    expect_equal_to_reference(launcher, random_foreign(static_cast<std::uint32_t>(k) % 24, parameters(seed % 8)), true);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
}

// Every particle a cluster of its own, so that several of them take in the same one.
Bodies singles(Node size) {
  Lists lists;
  for (int32_t p = 0; p < size[0] * size[1] * size[2]; ++p) lists.push_back({p});
  return hand_made(block_body(size[0], size[1], size[2]), lists, kCover);
}

TEST(GpuExpand, SchedulesLeaveTheSameOrderOfHolders) {
  std::vector<int> first;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    HostLauncher launcher(HostLauncher::Simulated{.schedule = random_walk(seed)});
    Bench bench(singles({4, 3, 2}), true);
    expand_on(launcher, bench);
    const int used = bench.staging.membership_begin.back();
    const std::vector<int> memberships(bench.staging.memberships.begin(), bench.staging.memberships.begin() + used);
    if (first.empty()) first = memberships;
    ASSERT_EQ(memberships, first);
  }
}

TEST(GpuExpand, EdgeCoverCoversEveryEdge) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Bench bench(random_foreign(seed, {ExpandRule::edge_cover, 1 + static_cast<int32_t>(seed % 3)}), true);
    expand_on(launcher, bench);
    const cutproof::Setup& setup = bench.bodies.setups.front();
    const State after = bench.states().front();
    EXPECT_TRUE(after.edge_covered);
    EXPECT_EQ(uncovered_edges(setup.body, after.alive, lists_of(after.clusters)), 0);
    const Verdict verdict = oracles::expansion(setup, bench.loaded.front(), after);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  }
}

TEST(GpuExpand, TheSmallerClusterGrowsAndAmongEqualOnesTheLowerNumber) {
  HostLauncher launcher;
  Bench smaller(hand_made(block_body(5, 1, 1), {range(0, 3), range(3, 5)}, kCover), true);
  expand_on(launcher, smaller);
  EXPECT_EQ(lists_of(smaller.states().front().clusters), (Lists{range(0, 3), range(2, 5)}));
  Bench equal(hand_made(block_body(4, 1, 1), {range(0, 2), range(2, 4)}, kCover), true);
  expand_on(launcher, equal);
  EXPECT_EQ(lists_of(equal.states().front().clusters), (Lists{range(0, 3), range(2, 4)}));
}

// Sizes and memberships are those of the input: the single particle 2 takes in both of its neighbours at once.
TEST(GpuExpand, AdditionsDoNotSeeEachOther) {
  HostLauncher launcher;
  Bench bench(hand_made(block_body(5, 1, 1), {range(0, 2), {2}, range(3, 5)}, kCover), true);
  expand_on(launcher, bench);
  EXPECT_EQ(lists_of(bench.states().front().clusters), (Lists{range(0, 2), range(1, 4), range(3, 5)}));
}

TEST(GpuExpand, PublishedLeavesAClusterThatSharesAParticle) {
  HostLauncher launcher;
  const ExpandParameters published = {ExpandRule::published, 1};
  Bench bench(hand_made(block_body(7, 1, 1), {range(0, 2), range(1, 4), range(4, 7)}, published), true);
  expand_on(launcher, bench);
  EXPECT_EQ(lists_of(bench.states().front().clusters), (Lists{range(0, 2), range(1, 4), range(3, 7)}));
  EXPECT_FALSE(bench.states().front().edge_covered);
}

TEST(GpuExpand, WhatIsCoveredOrWasNotCutIsLeftAsItIs) {
  HostLauncher launcher;
  for (const bool cut : {true, false}) {
    Bodies bodies = random_foreign(7, kCover);
    bodies.states.front().edge_covered = cut;
    Bench bench(bodies, cut);
    const auto memberships = bench.staging.memberships;
    expand_on(launcher, bench);
    EXPECT_EQ(bench.states(), bench.loaded);
    EXPECT_EQ(bench.staging.memberships, memberships);
  }
}

TEST(GpuExpand, ABodyThatCountsAsCoveredIsLeftAsItIsBesideOneThatDoesNot) {
  Bodies bodies = singles({3, 2, 2});
  bodies.add(bodies.setups.front(), bodies.states.front());
  bodies.states.back().edge_covered = true;
  HostLauncher launcher;
  Bench bench(std::move(bodies), true);
  expand_on(launcher, bench);
  const std::vector<State> after = bench.states();
  EXPECT_NE(after[0], bench.loaded[0]);
  EXPECT_EQ(after[1], bench.loaded[1]);
}

TEST(GpuExpand, BodiesOfOneLoadKeepTheirOwnRulesAndDepths) {
  HostLauncher launcher(HostLauncher::Threads{2});
  for (std::uint32_t seed = 0; seed < 200; seed += 10) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Bodies bodies;
    for (std::uint32_t k = 0; k < 10; ++k) {
      Bodies more = random_foreign(seed + k, parameters(k));
      if (k % 5 == 4) more.setups.front().expand.rule = ExpandRule::none;
      State& state = more.states.front();
      if (k % 3 != 0 && !state.x.empty()) {  // one in three was not cut
        Lists lists = lists_of(state.clusters);
        for (auto& list : lists) std::erase(list, 0);
        std::erase_if(lists, [](const auto& list) { return list.empty(); });
        state.clusters = clusters_of(more.setups.front().body, lists);
        remove_particles(state, {0});
      }
      bodies.add(more.setups.front(), state);
    }
    expect_equal_to_reference(launcher, std::move(bodies), false);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
}

// Rows of memberships of bodies that do not expand move, but keep their order, and with it the bits of sums.
TEST(GpuExpand, ParticlesThatNothingTakesInKeepTheOrderOfTheirHolders) {
  Bodies bodies = random_foreign(3, kCover);
  Bodies covered = random_foreign(4, kCover);
  covered.states.front().edge_covered = true;
  bodies.add(covered.setups.front(), covered.states.front());
  Bench bench(std::move(bodies), true);
  const int first = bench.staging.body[1].particle_begin, end = bench.staging.body[1].particle_end;
  const auto rows = [&] {
    std::vector<std::vector<int>> all;
    for (int p = first; p < end; ++p) {
      all.emplace_back(
          bench.staging.memberships.begin() + bench.staging.membership_begin[static_cast<std::size_t>(p)],
          bench.staging.memberships.begin() + bench.staging.membership_begin[static_cast<std::size_t>(p) + 1]);
      // In no order that sorting would leave, and with a hole.
    }
    return all;
  };
  for (int p = first; p < end; ++p) {
    const auto at = [&](int i) {
      return bench.staging.memberships.begin() + bench.staging.membership_begin[static_cast<std::size_t>(i)];
    };
    std::reverse(at(p), at(p + 1));
  }
  const auto before = rows();
  HostLauncher launcher;
  expand_on(launcher, bench);
  EXPECT_GT(bench.staging.membership_begin[static_cast<std::size_t>(first)], bench.loaded[0].clusters.offsets.back())
      << "the rows have not moved, so this shows nothing";
  EXPECT_EQ(rows(), before);
}

TEST(GpuExpand, WithoutRoomAnExpansionIsFlaggedAndChangesNothing) {
  HostLauncher launcher;
  const auto judge = [&](Bench& bench, int expected_fault) {
    const auto memberships = bench.staging.memberships;
    const int used = bench.staging.counters.front().members_used;
    expand_on(launcher, bench);
    EXPECT_EQ(bench.fault(), expected_fault);
    if (expected_fault == 0) return;
    EXPECT_EQ(bench.states(), bench.loaded);
    EXPECT_EQ(bench.staging.memberships, memberships);
    EXPECT_EQ(bench.staging.counters.front().members_used, used);
    expect_memberships_agree(bench.staging);
    for (const unsigned char dirty : bench.staging.rest_dirty) EXPECT_EQ(dirty, 0);
  };
  // Ten runs of two particles: nine clusters take in one particle each and need 27 places.
  Lists lists;
  for (int32_t c = 0; c < 10; ++c) lists.push_back(range(2 * c, 2 * c + 2));
  for (const int spare : {0, 9, 26, 27}) {
    Bench bench(hand_made(block_body(20, 1, 1), lists, kCover), true);
    bench.staging.member_capacity = 20 + spare;
    bench.staging.allocate();
    bench.view = bench.staging.view();
    judge(bench, spare < 27 ? kMembersFull : 0);
  }
  for (const int spare : {0, 1, 8, 9}) {
    Bench bench(hand_made(block_body(20, 1, 1), lists, kCover), true);
    bench.staging.addition_capacity = spare;
    bench.staging.allocate();
    bench.view = bench.staging.view();
    judge(bench, spare < 9 ? kAdditionsFull : 0);
  }
  // Capacity that a deeper layer exceeds.
  for (const int spare : {9, 12, 1000}) {
    Bench bench(hand_made(block_body(20, 1, 1), lists, {ExpandRule::edge_cover, 3}), true);
    bench.staging.addition_capacity = spare;
    bench.staging.allocate();
    bench.view = bench.staging.view();
    judge(bench, spare < 1000 ? kAdditionsFull : 0);
  }
}

TEST(GpuExpand, AfterAFaultOfAnEarlierStageNothingExpands) {
  Bench bench(random_foreign(3, kCover), true);
  bench.staging.counters.front().fault = kMembersFull;
  HostLauncher launcher;
  expand_on(launcher, bench);
  EXPECT_EQ(bench.states(), bench.loaded);
}

TEST(GpuExpand, ALoadWithoutBodiesOrClustersIsLeftAlone) {
  HostLauncher launcher;
  Bench empty((Bodies()));
  expand_on(launcher, empty);
  Bench no_particles(hand_made(body_of({}), {}, kCover), true);
  expand_on(launcher, no_particles);
  EXPECT_EQ(empty.fault() | no_particles.fault(), 0);
  EXPECT_TRUE(no_particles.states().front().edge_covered);
}

}  // namespace
}  // namespace cutproof::gpu::expand_kernel_test
