// I4: an edge of the tissue in no cluster is named.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::edge_cover_test {
namespace {

using namespace cutproof::tests;

TEST(EdgeCover, RejectsAnEdgeThatNoClusterContains) {
  Row row(5, {{0, 1, 2}, {3, 4}});
  row.state.edge_covered = true;
  const Verdict verdict = edge_cover(row.setup, row.state);
  expect_rejected(verdict, {}, {2, 3});
  EXPECT_EQ(verdict.witness.path, Numbers({2, 3}));
  EXPECT_EQ(verdict.checked, 4);
}

TEST(EdgeCover, RejectsEvenIfTheEndsAreCoupledAnotherWay) {
  // 2 3
  // 0 1: every particle is coupled, but the edge 1-3 lies in no cluster.
  const auto setup = setup_of(block_body(2, 2, 1));
  State state = state_of(setup.body, {{0, 1}, {0, 2}, {2, 3}});
  state.edge_covered = true;
  expect_holds(component_match(setup, state));
  expect_rejected(edge_cover(setup, state), {}, {1, 3});
}

TEST(EdgeCover, IsVacuousWhereItIsNotPromised) {
  Row row(5, {{0, 1, 2}, {3, 4}});
  const Verdict verdict = edge_cover(row.setup, row.state);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 0);
}

}  // namespace
}  // namespace cutproof::oracles::edge_cover_test
