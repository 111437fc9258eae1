// Split against method.md §5, on cases small enough to be worked out by hand, and against brute force on random ones.
#include <gtest/gtest.h>

#include <random>

#include "reference_cpu/reference.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::split_test {
namespace {

using namespace cutproof::tests;

// A rotation by a quarter turn about z, to be recognised again.
constexpr Mat3 kQuarterTurn = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};

// A wire of n particles along x.
State wire_state(Setup& setup, int32_t n, const Lists& lists) {
  setup = setup_of(block_body(n, 1, 1));
  return state_of(setup.body, lists);
}

TEST(Split, ReplacesAClusterByTheComponentsOfWhatIsLeft) {
  cutproof::Setup setup;
  State state = wire_state(setup, 9, {range(0, 9)});
  remove_particles(state, {2, 6});
  reference::split(setup, state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{0, 1}, {3, 4, 5}, {7, 8}}));
}

TEST(Split, LeavesTheNumberWithTheSmallestParticleAndCountsOnFromTheHighestByClusterThenParticle) {
  cutproof::Setup setup;
  State state = wire_state(setup, 12, {range(0, 8), range(2, 12), range(8, 12)});
  state.clusters.number = {3, 5, 9};
  remove_particles(state, {4, 6});
  reference::split(setup, state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{0, 1, 2, 3}, {2, 3}, {8, 9, 10, 11}, {5}, {7}, {5}, {7, 8, 9, 10, 11}}));
  EXPECT_EQ(state.clusters.number, (std::vector<int32_t>{3, 5, 9, 10, 11, 12, 13}));
}

TEST(Split, LetsAClusterWithoutParticlesVanishAndDoesNotGiveItsNumberAway) {
  cutproof::Setup setup;
  State state = wire_state(setup, 6, {{0, 1, 2, 3}, {4, 5}});
  remove_particles(state, {2, 4, 5});
  reference::split(setup, state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{0, 1}, {3}}));
  EXPECT_EQ(state.clusters.number, (std::vector<int32_t>{0, 2}));
}

TEST(Split, TouchesNothingOfAClusterThatLostNothingAndSharesNothing) {
  cutproof::Setup setup;
  State state = wire_state(setup, 8, {{0, 1, 2, 3}, {4, 5, 6, 7}});
  state.clusters.rotation[1] = kQuarterTurn;
  state.clusters.degenerate[1] = 1;
  const Clusters before = state.clusters;
  remove_particles(state, {1});
  reference::split(setup, state);
  ASSERT_EQ(lists_of(state.clusters), (Lists{{0}, {4, 5, 6, 7}, {2, 3}}));
  EXPECT_EQ(state.clusters.number[1], 1);
  EXPECT_EQ(state.clusters.rotation[1], before.rotation[1]);
  EXPECT_EQ(state.clusters.degenerate[1], 1);
  EXPECT_EQ(state.clusters.rest_center[1], before.rest_center[1]);
  EXPECT_EQ(state.clusters.mass[1], before.mass[1]);
}

TEST(Split, LetsEveryPieceInheritRotationAndFlagOfItsCluster) {
  cutproof::Setup setup;
  State state = wire_state(setup, 8, {{0, 1, 2, 3, 4}, {4, 5, 6, 7}});
  state.clusters.rotation[0] = kQuarterTurn;
  state.clusters.degenerate[0] = 1;
  remove_particles(state, {1, 6});
  reference::split(setup, state);
  ASSERT_EQ(lists_of(state.clusters), (Lists{{0}, {4, 5}, {2, 3, 4}, {7}}));
  EXPECT_EQ(state.clusters.rotation, (std::vector<Mat3>{kQuarterTurn, Mat3{}, kQuarterTurn, Mat3{}}));
  EXPECT_EQ(state.clusters.degenerate, (std::vector<uint8_t>{1, 0, 1, 0}));
}

TEST(Split, CountsOnlyEdgesInsideTheClusterAndOnlySixNeighbours) {
  // A square ring of 3 × 3 nodes without its middle. The first cluster is two arms that only meet in the corner that
  // is removed, although the ring goes on round the other way; the arms' ends are diagonal neighbours of nothing.
  const auto setup =
      setup_of(body_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 0}, {0, 2, 0}, {1, 2, 0}, {2, 2, 0}}));
  State state = state_of(setup.body, {{0, 1, 2, 3, 5}, range(0, 8)});
  remove_particles(state, {0});  // 1 and 3 are diagonal neighbours
  reference::split(setup, state);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{1, 2}, range(1, 8), {3, 5}}));
}

TEST(Split, RecomputesTheRestFramesOfClustersThatLostAParticle) {
  cutproof::Setup setup;
  State state = wire_state(setup, 4, {{0, 1, 2}, {1, 2, 3}});
  remove_particles(state, {3});
  reference::split(setup, state);
  // Weights 1, 1/2, 1/2 at x = 1, 2, 3 (the ring of empty nodes shifts by one), and 1/2, 1/2 at x = 2, 3.
  EXPECT_DOUBLE_EQ(state.clusters.mass[0], 2.0);
  EXPECT_DOUBLE_EQ(state.clusters.rest_center[0].x, (1 + 1 + 1.5) / 2);
  EXPECT_DOUBLE_EQ(state.clusters.mass[1], 1.0);
  EXPECT_DOUBLE_EQ(state.clusters.rest_center[1].x, 2.5);
}

TEST(Split, DoesNothingWhenNothingWasRemoved) {
  cutproof::Setup setup;
  State state = wire_state(setup, 5, {{0, 1, 2}, {2, 3, 4}});
  const State before = state;
  reference::split(setup, state);
  EXPECT_EQ(state, before);
}

TEST(Split, EndsWithoutClustersWhenTheWholeBodyIsRemoved) {
  cutproof::Setup setup;
  State state = wire_state(setup, 3, {{0, 1}, {1, 2}});
  remove_particles(state, {0, 1, 2});
  reference::split(setup, state);
  EXPECT_EQ(state.clusters, Clusters{});
}

TEST(Split, TakesOutDebrisFirstAndListsIt) {
  cutproof::Setup setup;
  State state = wire_state(setup, 12, {range(0, 7), range(5, 12)});
  setup.split.debris = 3;
  remove_particles(state, {2, 5, 9});  // leaves 0 1 | 3 4 | 6 7 8 | 10 11
  reference::split(setup, state);
  EXPECT_EQ(state.debris, (std::vector<int32_t>{0, 1, 3, 4, 10, 11}));
  EXPECT_EQ(state.removed, (std::vector<int32_t>{2, 5, 9}));
  for (const int32_t p : state.debris) EXPECT_EQ(state.alive[static_cast<std::size_t>(p)], 0);
  EXPECT_EQ(lists_of(state.clusters), (Lists{{6}, {6, 7, 8}}));
}

TEST(Split, KeepsSmallPiecesWhenNoDebrisIsAskedFor) {
  cutproof::Setup setup;
  State state = wire_state(setup, 5, {range(0, 5)});
  remove_particles(state, {1, 3});
  reference::split(setup, state);
  EXPECT_TRUE(state.debris.empty());
  EXPECT_EQ(lists_of(state.clusters), (Lists{{0}, {2}, {4}}));
}

TEST(Split, AgreesWithBruteForceOnRandomCoversAndRemovals) {
  constexpr uint32_t kSeed = 20240;
  std::mt19937 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  int64_t pieces = 0;
  for (int round = 0; round < 200; ++round) {
    const Body body = random_body(random, {5, 5, 4}, 0.8);
    const auto setup = setup_of(body);
    State state = state_of(body, random_cover(random, body, 20));
    const State before = state;
    std::vector<int32_t> removed;
    for (int32_t p = 0; p < body.particle_count(); ++p) {
      if (random() % 4 == 0) removed.push_back(p);
    }
    remove_particles(state, removed);
    reference::split(setup, state);

    // Two particles of a cluster are in one piece exactly if joined by alive particles of that cluster.
    Lists first, others;
    for (const auto& members : lists_of(before.clusters)) {
      Classes classes(body.particle_count());
      const ParticleSet set(members.begin(), members.end());
      const auto left = [&](int32_t p) { return set.count(p) > 0 && state.alive[static_cast<std::size_t>(p)] != 0; };
      for (const int32_t p : members) {
        for (const int32_t q : neighbours_of(body, p)) {
          if (left(p) && left(q)) classes.join(p, q);
        }
      }
      std::vector<std::vector<int32_t>> by_label(static_cast<std::size_t>(body.particle_count()));
      for (const int32_t p : members) {
        if (left(p)) by_label[static_cast<std::size_t>(classes.label(p))].push_back(p);
      }
      std::erase_if(by_label, [](const auto& list) { return list.empty(); });
      if (!by_label.empty()) first.push_back(by_label[0]);
      if (by_label.size() > 1) others.insert(others.end(), by_label.begin() + 1, by_label.end());
    }
    pieces += static_cast<int64_t>(others.size());
    first.insert(first.end(), others.begin(), others.end());
    ASSERT_EQ(lists_of(state.clusters), first) << "seed " << kSeed << ", round " << round;
    Clusters recomputed = state.clusters;
    set_rest_frames(body, recomputed);
    for (std::size_t c = 0; c < recomputed.mass.size(); ++c) {
      ASSERT_NEAR(state.clusters.mass[c], recomputed.mass[c], 1e-12);
      ASSERT_LT(norm(state.clusters.rest_center[c] - recomputed.rest_center[c]), 1e-12);
    }
  }
  EXPECT_GT(pieces, 0);
}

}  // namespace
}  // namespace cutproof::split_test
