// Groups of clusters that are isolated within connected tissue are named.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::isolation_test {
namespace {

using namespace cutproof::tests;

TEST(Isolation, RejectsAGroupOfClustersThatOverlapEachOtherOnly) {
  Row row(8, {{0, 1, 2, 3}, {3, 4}, {5, 6}, {6, 7}});
  const Verdict verdict = isolation(row.setup, row.state);
  expect_rejected(verdict, {2, 3}, {5, 4});
  EXPECT_EQ(verdict.witness.path, Numbers({5, 4}));
  EXPECT_EQ(verdict.measured, 1);
  EXPECT_EQ(verdict.bound, 0);
}

TEST(Isolation, IsAboutConnectedTissueOnly) {
  Row row(5, {{0, 1}, {3, 4}});
  remove_particles(row.state, {2});
  expect_holds(isolation(row.setup, row.state));
}

TEST(Isolation, IsNotHiddenByAClusterThatCouplesAcrossAGap) {
  // As many couplings as components, yet {2} is isolated from {0, 1}.
  Row row(7, {{0, 1}, {1, 4}, {2}, {5, 6}, {4, 5}});
  remove_particles(row.state, {3});
  expect_rejected(isolation(row.setup, row.state), {2}, {2, 1});
  EXPECT_NE(isolation(row.setup, row.state).witness.text.find("clusters is a group of 1 particle that"),
            std::string::npos);
}

TEST(Isolation, SaysOfAParticleWithoutAClusterThatItHasNone) {
  Row row(4, {{0, 1, 2}});
  const Verdict verdict = isolation(row.setup, row.state);
  expect_rejected(verdict, {}, {3, 2});
  EXPECT_EQ(verdict.witness.text, "particle 3 lies in no cluster, though it is a neighbour of particle 2");
}

}  // namespace
}  // namespace cutproof::oracles::isolation_test
