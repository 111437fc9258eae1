// I1: a cluster in pieces is rejected with a particle of each.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::cluster_connectivity_test {
namespace {

using namespace cutproof::tests;

TEST(ClusterConnectivity, RejectsAClusterInTwoPiecesWithAParticleOfEach) {
  Row row(5, {{0, 1, 2}, {0, 1, 3, 4}, {2, 3}});
  row.state.clusters.number = {2, 7, 9};
  const Verdict verdict = cluster_connectivity(row.setup, row.state);
  expect_rejected(verdict, {7}, {0, 3});
  EXPECT_EQ(verdict.measured, 1);
  EXPECT_EQ(verdict.checked, 3);
}

TEST(ClusterConnectivity, RejectsAClusterThatACutHasDivided) {
  Row row(5, {{0, 1, 2, 3, 4}});
  remove_particles(row.state, {2});
  expect_rejected(cluster_connectivity(row.setup, row.state), {0}, {0, 3});
}

TEST(ClusterConnectivity, RejectsAClusterHeldTogetherOnlyByParticlesOfAnother) {
  // 3 4 5
  // 0 1 2   cluster 0 is a frame without its middle; 1 and 4 are in cluster 1 only.
  const auto setup = setup_of(block_body(3, 2, 1));
  const State state = state_of(setup.body, {{0, 2, 3, 5}, {1, 4}});
  expect_rejected(cluster_connectivity(setup, state), {0}, {0, 2});
}

TEST(ClusterConnectivity, RejectsACornerContact) {
  const auto setup = setup_of(block_body(2, 2, 1));
  expect_rejected(cluster_connectivity(setup, state_of(setup.body, {{0, 3}, {1, 2, 3}})), {0}, {0, 3});
}

}  // namespace
}  // namespace cutproof::oracles::cluster_connectivity_test
