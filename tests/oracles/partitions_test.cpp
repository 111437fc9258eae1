// Partitions of the alive particles, against answers known by hand and against each other.
#include <gtest/gtest.h>

#include <random>

#include "oracles/comparison/sparse_components.h"
#include "oracles/oracles.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::partitions_test {
namespace {

using namespace cutproof::tests;

// 5 × 1 × 1: 0 1 2 3 4.
struct Row {
  Setup setup = setup_of(block_body(5, 1, 1));
  State state = state_of(setup.body, {{0, 1, 2}, {2, 3, 4}});
};

TEST(GraphComponents, AreNumberedBySmallestParticleAndLeaveOutTheDead) {
  Row row;
  EXPECT_EQ(graph_components(row.setup, row.state).label, std::vector<int32_t>({0, 0, 0, 0, 0}));
  row.state.alive[1] = 0;
  const Partition parts = graph_components(row.setup, row.state);
  EXPECT_EQ(parts.label, std::vector<int32_t>({0, -1, 1, 1, 1}));
  EXPECT_EQ(parts.count, 2);
}

TEST(GraphComponents, JoinSixNeighboursOnly) {
  const auto setup = setup_of(body_of({{0, 0, 0}, {1, 1, 0}, {1, 1, 1}}));
  EXPECT_EQ(graph_components(setup, state_of(setup.body, {{0, 1, 2}})).label, std::vector<int32_t>({0, 1, 1}));
}

TEST(CouplingComponents, JoinWhatSharesAClusterConnectedOrNot) {
  Row row;
  row.state.clusters = clusters_of(row.setup.body, {{0, 4}, {1, 2}, {2, 3}});
  const Partition parts = coupling_components(row.setup, row.state);
  EXPECT_EQ(parts.label, std::vector<int32_t>({0, 1, 1, 1, 0}));
  EXPECT_EQ(parts.count, 2);
}

TEST(CouplingComponents, DeadParticlesCoupleNothingAndUncoveredOnesStandAlone) {
  Row row;
  row.state.clusters = clusters_of(row.setup.body, {{0, 1, 2}, {2, 3}});
  row.state.alive[2] = 0;
  EXPECT_EQ(coupling_components(row.setup, row.state).label, std::vector<int32_t>({0, 0, -1, 1, 2}));
}

TEST(Components, OfABodyOfNoneAndOfOneParticle) {
  const auto none = setup_of(body_of({}));
  const State empty = state_of(none.body, {});
  EXPECT_EQ(graph_components(none, empty).count, 0);
  EXPECT_EQ(coupling_components(none, empty).count, 0);
  EXPECT_EQ(graph_component_count_btf(none, empty), 0);
  EXPECT_EQ(graph_component_count_spqr(none, empty), 0);

  const auto one = setup_of(block_body(1, 1, 1));
  State state = state_of(one.body, {{0}});
  EXPECT_EQ(graph_components(one, state).count, 1);
  EXPECT_EQ(coupling_components(one, state).count, 1);
  EXPECT_EQ(graph_component_count_btf(one, state), 1);
  EXPECT_EQ(graph_component_count_spqr(one, state), 1);
  state.alive[0] = 0;
  EXPECT_EQ(graph_components(one, state).count, 0);
  EXPECT_EQ(graph_component_count_btf(one, state), 0);
  EXPECT_EQ(graph_component_count_spqr(one, state), 0);
}

TEST(Components, CountedByBfsBtfAndSpqrAgreeOnRandomPatterns) {
  constexpr uint64_t kSeed = 20260101;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int32_t most = 0, connected = 0;
  for (int round = 0; round < 150; ++round) {
    const auto side = [&] { return static_cast<int32_t>(1 + random() % 8); };
    const auto setup = setup_of(block_body(side(), side(), side()));
    State state = state_of(setup.body, {range(0, setup.body.particle_count())});
    const uint64_t percent = random() % 101;  // of particles that are alive
    for (auto& alive : state.alive) alive = random() % 100 < percent ? 1 : 0;
    const int32_t count = graph_components(setup, state).count;
    EXPECT_EQ(graph_component_count_btf(setup, state), count) << "round " << round;
    EXPECT_EQ(graph_component_count_spqr(setup, state), count) << "round " << round;
    most = std::max(most, count);
    connected += count == 1 ? 1 : 0;
  }
  EXPECT_GT(most, 20);  // the classes that matter have occurred
  EXPECT_GT(connected, 10);
}

TEST(Components, OfABrokenStateAreNone) {
  Row row;
  row.state.clusters.members[0] = 99;
  EXPECT_EQ(graph_components(row.setup, row.state).count, 0);
  EXPECT_EQ(coupling_components(row.setup, row.state).count, 0);
  EXPECT_EQ(graph_component_count_btf(row.setup, row.state), 0);
  EXPECT_EQ(graph_component_count_spqr(row.setup, row.state), 0);
}

TEST(WeakCouplings, TellJointsHingesAndFirmCouplingsApart) {
  // 3 × 3 × 1:  6 7 8
  //             3 4 5
  //             0 1 2
  const auto setup = setup_of(block_body(3, 3, 1));
  const auto weak = [&](const Lists& lists) { return weak_couplings(setup, state_of(setup.body, lists)); };
  const WeakCouplings joint = weak({{0, 1, 3, 4}, {4, 5, 7, 8}});
  EXPECT_EQ(joint.ball_joints, 1);
  EXPECT_EQ(joint.hinges, 0);
  const WeakCouplings hinge = weak({{0, 1, 3, 4, 6, 7}, {1, 2, 4, 5, 7, 8}});
  EXPECT_EQ(hinge.ball_joints, 0);
  EXPECT_EQ(hinge.hinges, 1);
  const WeakCouplings diagonal = weak({{0, 4, 8}, {0, 2, 4, 8}});
  EXPECT_EQ(diagonal.hinges, 1);
  const WeakCouplings firm = weak({{0, 1, 3, 4}, {1, 2, 3, 4}});
  EXPECT_EQ(firm.ball_joints + firm.hinges, 0);
  const WeakCouplings apart = weak({{0, 1, 2}, {6, 7, 8}});
  EXPECT_EQ(apart.ball_joints + apart.hinges, 0);
}

TEST(WeakCouplings, CountEveryPairOfClusters) {
  const auto setup = setup_of(block_body(3, 1, 1));
  const WeakCouplings weak = weak_couplings(setup, state_of(setup.body, {{0, 1}, {1, 2}, {1}, {0, 1, 2}}));
  EXPECT_EQ(weak.ball_joints, 4);  // 0-1, 0-2, 1-2, 2-3
  EXPECT_EQ(weak.hinges, 2);       // 0-3, 1-3
}

}  // namespace
}  // namespace cutproof::oracles::partitions_test
