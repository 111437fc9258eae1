// Rest centers and masses that are not those of the members are rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::rest_frames_test {
namespace {

using namespace cutproof::tests;

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

// A thousand equal terms round the same way, so the error of a plain sum grows as their number and not as its root.
TEST(RestFrames, AcceptPlainSumsOfAThousandMembersInSinglePrecision) {
  cutproof::Setup setup = setup_of(block_body(10, 10, 10, 0.1, 0.9487007976901066));
  const Body& body = setup.body;
  const State exact = state_of(body, {range(0, 1000)});
  const auto summed = [&](bool from_first) {
    State state = exact;
    state.precision = Precision::binary32;
    const Vec3 first = from_first ? body.rest_position(0) : Vec3{};
    float mass = 0, sum[3] = {};
    for (int32_t i = 0; i < 1000; ++i) {
      const auto w = static_cast<float>(body.mass[static_cast<std::size_t>(i)]);
      mass += w;
      for (int axis = 0; axis < 3; ++axis) {
        sum[axis] += w * (static_cast<float>(body.rest_position(i)[axis]) - static_cast<float>(first[axis]));
      }
    }
    state.clusters.mass[0] = mass;
    for (int axis = 0; axis < 3; ++axis) {
      state.clusters.rest_center[0][axis] =
          from_first ? first[axis] + static_cast<double>(sum[axis] / mass) : static_cast<double>(sum[axis] / mass);
    }
    return state;
  };
  const State relative = summed(true);
  EXPECT_GT(std::abs(relative.clusters.mass[0] / exact.clusters.mass[0] - 1), 200 * 0x1p-24);
  expect_holds(rest_frames(setup, relative));
  // Coordinates that were handed over in single precision are off by u of the greatest.
  State absolute = summed(false);
  absolute.place_rounding = 0x1p-24 * norm(body.rest_position(999));
  expect_holds(rest_frames(setup, absolute));
  // What a cluster of a thousand makes of a member that was forgotten, and of one that counts twice.
  for (const double share : {-1e-3, 1e-3}) {
    State wrong = absolute;
    wrong.clusters.mass[0] *= 1 + share;
    expect_rejected(rest_frames(setup, wrong), {0}, {});
    wrong = absolute;
    wrong.clusters.rest_center[0] += share * (body.rest_position(999) - exact.clusters.rest_center[0]);
    expect_rejected(rest_frames(setup, wrong), {0}, {});
  }
}

TEST(RestFrames, AreThoseOfBeforeBetweenDetectAndSplit) {
  Block block;
  remove_particles(block.state, {0, 5, 10});
  expect_holds(rest_frames(block.setup, block.state));
}

}  // namespace
}  // namespace cutproof::oracles::rest_frames_test
