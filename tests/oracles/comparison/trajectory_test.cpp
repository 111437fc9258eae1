#include "oracles/comparison/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/oracles/states.h"

namespace cutproof::oracles::trajectory_test {
namespace {

using tests::block_body;
using tests::range;
using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;

// 4 × 1 × 1 particles.
struct Wire {
  cutproof::Setup setup = setup_of(block_body(4, 1, 1, kH), 1);
  State state = state_of(setup.body, {range(0, 4)});
};

TEST(PosesApart, AreTheDistancesOfWhatBothHave) {
  const Wire wire;
  const Pose rest = pose_of(wire.setup, wire.state, nullptr);
  EXPECT_EQ(poses_apart(wire.setup, rest, rest).position.max, 0);
  State moved = wire.state;
  moved.x[0] += Vec3{0, 3 * kH, 0};
  moved.x[2] += Vec3{0, 0, 4 * kH};
  Apart apart = poses_apart(wire.setup, rest, pose_of(wire.setup, moved, nullptr));
  EXPECT_NEAR(apart.position.max, 4, 1e-12);
  EXPECT_EQ(apart.position.where, 2);
  EXPECT_NEAR(apart.position.rms(), std::sqrt((9.0 + 16.0) / 4), 1e-12);
  EXPECT_EQ(apart.alive_in_one, 0);

  // What only one of the two has is counted and not measured, whichever has it.
  moved.alive[2] = 0;
  const Pose without = pose_of(wire.setup, moved, nullptr);
  for (const bool swapped : {false, true}) {
    apart = swapped ? poses_apart(wire.setup, without, rest) : poses_apart(wire.setup, rest, without);
    EXPECT_NEAR(apart.position.rms(), std::sqrt(9.0 / 3), 1e-12);
    EXPECT_EQ(apart.alive_in_one, 1);
  }
}

TEST(PosesApart, OfWhatIsNoNumberAreInfinite) {
  const Wire wire;
  State broken = wire.state;
  broken.x[1].y = std::numeric_limits<double>::quiet_NaN();
  const Apart apart =
      poses_apart(wire.setup, pose_of(wire.setup, wire.state, nullptr), pose_of(wire.setup, broken, nullptr));
  EXPECT_TRUE(std::isinf(apart.position.max));
  EXPECT_TRUE(std::isinf(apart.position.rms()));
}

TEST(PoseOf, CountsPartsAnewOnlyWhereSomethingWasRemoved) {
  const Wire wire;
  Pose earlier = pose_of(wire.setup, wire.state, nullptr);
  EXPECT_EQ(earlier.components, 1);
  earlier.components = 17;  // to see that it is taken over
  EXPECT_EQ(pose_of(wire.setup, wire.state, &earlier).components, 17);
  State cut = wire.state;
  cut.alive[1] = 0;
  EXPECT_EQ(pose_of(wire.setup, cut, &earlier).components, 2);

  std::vector<Pose> poses;
  add_pose(poses, wire.setup, wire.state);
  EXPECT_EQ(poses.back().components, 1) << "there is none before";
  poses.back() = earlier;
  add_pose(poses, wire.setup, wire.state);
  add_pose(poses, wire.setup, cut);
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[1].components, 17);
  EXPECT_EQ(poses[2].components, 2);
  EXPECT_EQ(poses[2].alive, cut.alive);
}

}  // namespace
}  // namespace cutproof::oracles::trajectory_test
