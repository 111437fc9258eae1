// Rest centers and masses that are not those of the members are rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles {
namespace {

using namespace cutproof::testing;

TEST(RestFrames, RejectsANeighbourOfAMergeThatWasForgotten) {
  Row row(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}, {2, 3, 4}});
  const Clusters old = row.state.clusters;
  // 1 and 3 are merged, so n_2 and n_3 changed: cluster 0 and 2 must follow, but only the union was recomputed.
  row.state.clusters = clusters_of(row.setup.body, {{0, 1, 2}, {2, 3, 4}, {3, 4, 5}});
  expect_holds(rest_frames(row.setup, row.state));
  row.state.clusters.rest_center[0] = old.rest_center[0];
  row.state.clusters.mass[0] = old.mass[0];
  expect_rejected(rest_frames(row.setup, row.state), {0}, {});
}

TEST(RestFrames, RejectsAMassThatIsOffByLittle) {
  Block block;
  block.state.clusters.mass[2] *= 1 + 1e-9;
  expect_rejected(rest_frames(block.setup, block.state), {2}, {});
}

TEST(RestFrames, RejectsNotANumber) {
  Block block;
  block.state.clusters.rest_center[1].y = kNan;
  expect_rejected(rest_frames(block.setup, block.state), {1}, {});
}

TEST(RestFrames, AcceptSumsInAnyOrder) {
  Block block(12, 12, 12);
  std::mt19937 random(3);
  block.setup.body.grid.spacing = 0.1;  // no dyadic fractions, so that sums round
  for (double& mass : block.setup.body.mass) mass = std::uniform_real_distribution<double>(0.1, 1)(random);
  set_rest_frames(block.setup.body, block.state.clusters);
  State shuffled = block.state;
  for (int32_t c = 0; c < shuffled.clusters.count(); ++c) {
    const auto first = shuffled.clusters.members.begin() + shuffled.clusters.offsets[static_cast<std::size_t>(c)];
    std::shuffle(first, first + shuffled.clusters.size(c), random);
  }
  set_rest_frames(block.setup.body, shuffled.clusters);
  EXPECT_FALSE(shuffled.clusters.rest_center == block.state.clusters.rest_center);  // bits do differ
  block.state.clusters.rest_center = shuffled.clusters.rest_center;
  block.state.clusters.mass = shuffled.clusters.mass;
  expect_holds(rest_frames(block.setup, block.state));
}

TEST(RestFrames, AreThoseOfBeforeBetweenDetectAndSplit) {
  Block block;
  remove_particles(block.state, {0, 5, 10});
  expect_holds(rest_frames(block.setup, block.state));
}

}  // namespace
}  // namespace cutproof::oracles
