// Momentum over a frame: accepted where the reference computed it, rejected where it was broken by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles {
namespace {

using namespace cutproof::testing;

struct ThrownBlock {
  cutproof::Setup setup;
  State before, after;
};

// A block that is thrown, spinning and stretched, with everything that gives momentum: gravity, damping, a wall with
// friction that it hits, and a grip that pulls at one corner.
ThrownBlock thrown_block(Solver solver) {
  ThrownBlock scene{setup_of(block_body(6, 5, 4, 0.01, 0.002)), {}, {}};
  scene.setup.step.solver = solver;
  scene.setup.step.gravity = {1, -2, -9.81};
  scene.setup.step.damping = 3;
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = 0.0099, .friction = 0.4}};
  scene.setup.grips = {{.particles = {118, 119}, .active = {1, 1, 0, 1}, .displacement = {4, Vec3{0.001, 0, 0.0005}}}};
  scene.before = state_of(scene.setup.body, box_clusters(6, 5, 4, 2));
  for (std::size_t i = 0; i < scene.before.x.size(); ++i) {
    Vec3& x = scene.before.x[i];
    x.x *= 1.1;
    scene.before.v[i] = {0.3 - 4 * x.y, 4 * x.x, -0.5};
  }
  scene.after = scene.before;
  reference::step(scene.setup, scene.after);
  return scene;
}

TEST(Momentum, HoldsForTheReferenceWithEveryCauseAtWork) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    const ThrownBlock scene = thrown_block(solver);
    ASSERT_GT(norm(scene.after.impulse), 0) << "wall and grip must have acted";
    const Verdict verdict = momentum(scene.setup, scene.before, scene.after);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
    EXPECT_EQ(verdict.checked, 120);
    double momentum_scale = 0;
    for (std::size_t i = 0; i < scene.after.v.size(); ++i) momentum_scale += 0.002 * norm(scene.after.v[i]);
    EXPECT_LT(verdict.measured / momentum_scale, 1e-12) << "conserved to 1e-12 of Σ m |v|";
    EXPECT_LT(verdict.bound / momentum_scale, 1e-9) << "the bound must be able to reject";
  }
}

TEST(Momentum, RejectsAKickThatNobodyGave) {
  ThrownBlock scene = thrown_block(Solver::implicit);
  double momentum_scale = 0;
  for (const Vec3 v : scene.after.v) momentum_scale += 0.002 * norm(v);
  scene.after.v[7].x += 1e-9 * momentum_scale / 0.002;
  const Verdict verdict = momentum(scene.setup, scene.before, scene.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NEAR(verdict.measured, 1e-9 * momentum_scale, 1e-11 * momentum_scale);
  EXPECT_NE(verdict.witness.text.find("momentum"), std::string::npos);
}

TEST(Momentum, RejectsAnImpulseThatWasForgottenOrLeaksThroughDamping) {
  const ThrownBlock good = thrown_block(Solver::implicit);
  ThrownBlock scene = good;
  scene.after.impulse = {};
  EXPECT_FALSE(momentum(scene.setup, scene.before, scene.after).holds);
  scene = good;
  scene.setup.step.damping = 3.001;
  EXPECT_FALSE(momentum(scene.setup, scene.before, scene.after).holds);
  scene = good;
  scene.setup.step.gravity.z = 0;
  EXPECT_FALSE(momentum(scene.setup, scene.before, scene.after).holds);
}

TEST(Momentum, RejectsAVelocityThatIsNotANumber) {
  ThrownBlock scene = thrown_block(Solver::implicit);
  scene.after.v[0].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(momentum(scene.setup, scene.before, scene.after).holds);
}

TEST(Momentum, IsNotJudgedOnAStateThatIsNotWellFormed) {
  ThrownBlock scene = thrown_block(Solver::implicit);
  scene.after.v.pop_back();
  const Verdict verdict = momentum(scene.setup, scene.before, scene.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("not judged"), std::string::npos);
}

TEST(Momentum, CountsOnlyWhatIsAliveBeforeDetection) {
  ThrownBlock scene = thrown_block(Solver::implicit);
  scene.before.alive[3] = 0;
  scene.before.clusters = testing::clusters_of(scene.setup.body, [] {
    auto lists = box_clusters(6, 5, 4, 2);
    for (auto& list : lists) std::erase(list, 3);
    return lists;
  }());
  scene.before.v[3] = {1e3, 0, 0};
  scene.after = scene.before;
  reference::step(scene.setup, scene.after);
  const Verdict verdict = momentum(scene.setup, scene.before, scene.after);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.checked, 119);
}

}  // namespace
}  // namespace cutproof::oracles
