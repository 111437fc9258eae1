// What a frame does around its stages: memberships come back into their order where they may have left it, and clusters
// are numbered as their slots come.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/frame.h"
#include "gpu/host/host_launcher.h"
#include "gpu/host/thread_schedule.h"
#include "model/at.h"
#include "tests/gpu/kernels/cluster_stages.h"

namespace cutproof::gpu::frame_kernel_test {
namespace {

using tests::Bench;
using tests::Bodies;
using tests::expect_memberships_agree;

bool is_in_order(const StagingBuffers& staging, std::size_t p) {
  const auto list = staging.memberships.begin();
  return std::is_sorted(list + staging.membership_begin[p], list + staging.membership_begin[p + 1],
                        [](int a, int b) { return static_cast<unsigned>(a) < static_cast<unsigned>(b); });
}

// Three random bodies, as `change` leaves their setups; and how many frames the longest has.
template <class Change>
Bodies three_bodies(std::uint64_t seed, Change change, std::int64_t& frames) {
  property_tests::Random random(seed);
  Bodies bodies;
  frames = 0;
  for (int k = 0; k < 3; ++k) {
    auto [setup, state] = property_tests::instance_of(property_tests::draw_case(random.seed(), 60));
    change(setup);
    frames = std::max(frames, setup.frame_count());
    bodies.add(std::move(setup), std::move(state));
  }
  return bodies;
}

TEST(Frame, BringsMembershipsIntoTheirOrder) {
  int out_of_order = 0, left_alone = 0;  // the latter in frames that mark others
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::int64_t frames = 0;
    Bench bench(three_bodies(
        seed, [](cutproof::Setup&) {}, frames));
    HostLauncher launcher;
    for (std::int64_t f = 0; f < frames; ++f) {
      enqueue_span(launcher, bench.view, bench.plan, Span{Stage::step, Stage::expand}, [](Stage) {});
      const auto& marks = bench.staging.unsorted;
      const bool any = std::any_of(marks.begin(), marks.end(), [](int mark) { return mark != 0; });
      for (std::size_t p = 0; p < bench.staging.node.size(); ++p) {
        const bool marked = bench.staging.unsorted[p / kParticleTile] != 0;
        if (!is_in_order(bench.staging, p)) {
          ++out_of_order;
          ASSERT_TRUE(marked) << "particle " << p << " in frame " << f;
        }
        left_alone += any && !marked;
      }
      enqueue_span(launcher, bench.view, bench.plan, Span{Stage::skin, Stage::skin}, [](Stage) {});
      for (std::size_t p = 0; p < bench.staging.node.size(); ++p) ASSERT_TRUE(is_in_order(bench.staging, p)) << p;
      for (const int marked : bench.staging.unsorted) ASSERT_EQ(marked, 0);
    }
  }
  EXPECT_GT(out_of_order, 100);
  EXPECT_GT(left_alone, 1000);
}

// Of two, whoever goes goes on for long. At random the shorter of two pieces is done before the longer one has come to
// what both use.
Generator long_turns(std::uint64_t seed) {
  return [walk = random_walk(seed), random = std::mt19937_64(seed)](const Candidates& candidates) mutable {
    const bool goes_on = candidates.count() == 2 && random() % 16 != 0 && candidates.contains(candidates.current);
    return goes_on ? candidates.current : walk(candidates);
  };
}

// What runs side by side in a frame touches nothing of one another: whole frames that cut, merge, expand and have a
// skin end with the same bits in whatever order their launches come.
TEST(Frame, RunsItsPiecesSideBySideInAnyOrder) {
  int growing = 0, merging = 0, first_skins = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE(seed);
    std::int64_t frames = 0;
    const Bodies bodies = three_bodies(
        seed,
        [](cutproof::Setup& setup) {
          setup.expand.rule = ExpandRule::published;
          setup.merge.rule = MergeRule::deterministic;
          setup.skin.wanted = true;
        },
        frames);
    Bench in_order(bodies), in_turns(bodies);
    HostLauncher plain;
    HostLauncher scheduled(
        HostLauncher::Simulated{.schedule = seed % 2 == 0 ? random_walk(seed) : long_turns(seed), .live_blocks = 2});
    const auto run = [](HostLauncher& launcher, Bench& bench) {
      enqueue_span(launcher, bench.view, bench.plan, Span{Stage::step, Stage::skin}, [](Stage) {});
    };
    for (Bench* bench : {&in_order, &in_turns}) {
      enqueue_groups_if_stale(plain, bench->view);
      bench->spoil_scratch();
    }
    for (std::int64_t f = 0; f < frames; ++f) {
      const Counters& counters = in_order.staging.counters.front();
      run(plain, in_order);
      growing += counters.skin_changes > 0 && counters.expanding != 0 && counters.growth > 0;
      merging += counters.changing != 0 && counters.small > 0;
      first_skins += f == 0 && counters.changing != 0;
      run(scheduled, in_turns);
      ASSERT_EQ(in_order.fault(), 0);
      ASSERT_EQ(in_turns.fault(), 0);
      ASSERT_TRUE(in_order.states() == in_turns.states()) << "frame " << f;
      expect_memberships_agree(in_turns.staging);
      ASSERT_EQ(in_turns.staging.counters.front().groups, counters.groups);
    }
  }
  EXPECT_GT(growing, 20);
  EXPECT_GT(merging, 20);
  EXPECT_GT(first_skins, 20);
}

// What nobody has marked costs no look: a list that is put out of order behind everybody's back stays so.
TEST(Frame, SortsOnlyMembershipsThatAreMarked) {
  cutproof::Setup setup;
  setup.body = fixtures::block(12, 12, 12, 0.01);
  setup.substep_length = {1e-3};
  Bodies bodies;
  bodies.add(setup, fixtures::cook(setup.body, ClusterSpec{}, setup.expand, setup.merge, 1));
  Bench bench(std::move(bodies));
  std::vector<std::size_t> several;
  for (std::size_t p = 0; p < bench.staging.node.size(); ++p) {
    if (bench.staging.membership_count[p] > 1) several.push_back(p);
  }
  const std::size_t marked = several.front(), other = several.back();
  ASSERT_NE(marked / kParticleTile, other / kParticleTile);
  for (const std::size_t p : {marked, other}) {
    const auto first = bench.staging.memberships.begin() + bench.staging.membership_begin[p];
    std::swap(first[0], first[1]);
    ASSERT_FALSE(is_in_order(bench.staging, p));
  }
  bench.staging.unsorted[marked / kParticleTile] = 1;
  HostLauncher launcher;
  launcher.teams(sort_memberships_kernel_object{}, kParticleTile, particle_tiles(bench.view.particles), bench.view);
  EXPECT_TRUE(is_in_order(bench.staging, marked));
  EXPECT_FALSE(is_in_order(bench.staging, other));
  EXPECT_EQ(bench.staging.unsorted[marked / kParticleTile], 0);
}

// More slots than two blocks number, of which some are empty.
TEST(Frame, NumbersClustersInTheOrderOfTheirSlots) {
  Bodies bodies;
  for (const int side : {27, 6}) {
    cutproof::Setup setup;
    setup.body = fixtures::block(side, side, side, 0.01);
    setup.substep_length = {1e-3};
    setup.step.substeps = 1;
    ClusterSpec spec;
    spec.side = 1;
    State state = fixtures::cook(setup.body, spec, setup.expand, setup.merge, 1);
    bodies.add(std::move(setup), std::move(state));
  }
  for (const bool together : {false, true}) {
    Bodies some;
    for (std::size_t b = 0; b < (together ? 2u : 1u); ++b) some.add(bodies.setups[b], bodies.states[b]);
    Bench bench(std::move(some));
    const int slots = bench.staging.counters.front().slots_used;
    ASSERT_GT(slots, 2 * kSlotRun);
    std::mt19937_64 random(5);
    for (int s = 0; s < slots; ++s) {
      if (random() % 3 == 0) bench.staging.slot_size[at(s)] = 0;
      if (together) bench.staging.slot_body[at(s)] = static_cast<int>(random() % 2);  // as after splits of both
    }
    for (const int threads : {1, 4}) {
      std::fill(bench.staging.slot_number.begin(), bench.staging.slot_number.end(), -7);
      HostLauncher launcher{HostLauncher::Threads{threads}};
      launcher.blocks(number_slots_kernel_object{}, bench.view.bodies * slot_runs(slots), kListThreads, 0, bench.view);
      std::vector<int> next(2, 0);
      for (int s = 0; s < slots; ++s) {
        if (bench.staging.slot_size[at(s)] == 0) {
          ASSERT_EQ(bench.staging.slot_number[at(s)], -7) << "slot " << s << " is empty";
          continue;
        }
        ASSERT_EQ(bench.staging.slot_number[at(s)], next[at(bench.staging.slot_body[at(s)])]++) << "slot " << s;
      }
    }
  }
}

}  // namespace
}  // namespace cutproof::gpu::frame_kernel_test
