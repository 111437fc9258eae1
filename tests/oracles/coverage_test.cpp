// I2: who is in no cluster, or dead in one, is named.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::coverage_test {
namespace {

using namespace cutproof::tests;

TEST(Coverage, RejectsAnAliveParticleInNoCluster) {
  Row row(4, {{0, 1}, {1, 2}});
  expect_rejected(coverage(row.setup, row.state), {}, {3});
}

TEST(Coverage, RejectsADeadParticleInACluster) {
  Row row(4, {{0, 1, 2}, {2, 3}});
  remove_particles(row.state, {2});
  const Verdict verdict = coverage(row.setup, row.state);
  expect_rejected(verdict, {0}, {2});
  EXPECT_EQ(verdict.measured, 2);  // in both clusters
}

TEST(Coverage, RejectsMembersOutOfOrderAndTwice) {
  Row row(3, {{0, 2, 1}});
  expect_rejected(coverage(row.setup, row.state), {0}, {2, 1});
  Row twice(3, {{0, 1, 1, 2}});
  expect_rejected(coverage(twice.setup, twice.state), {0}, {1});
}

TEST(Coverage, RejectsAnEmptyCluster) {
  Row row(3, {{0, 1, 2}, {}});
  expect_rejected(coverage(row.setup, row.state), {1}, {});
}

TEST(Coverage, RejectsARemovedParticleThatIsAlive) {
  Row row(3, {{0, 1, 2}});
  row.state.removed = {1};
  expect_rejected(coverage(row.setup, row.state), {}, {1});
}

}  // namespace
}  // namespace cutproof::oracles::coverage_test
