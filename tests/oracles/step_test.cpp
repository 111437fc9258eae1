// Momentum over a frame, of all tissue and of its components: accepted where the reference computed it, rejected where
// it was broken by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "model/at.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::step_test {
namespace {

using namespace cutproof::tests;

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
  EXPECT_NE(verdict.witness.text.find("could not be judged"), std::string::npos);
}

TEST(Momentum, CountsOnlyWhatIsAliveBeforeDetection) {
  ThrownBlock scene = thrown_block(Solver::implicit);
  scene.before.alive[3] = 0;
  scene.before.clusters = tests::clusters_of(scene.setup.body, [] {
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

// --- Of each component -----------------------------------------------------------------------------------------------

// A block that falls, spins and is stretched, cut in two by a layer without particles.
ThrownBlock two_pieces() {
  ThrownBlock scene{setup_of(block_body(7, 4, 4, 0.01, 0.002)), {}, {}};
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.step.damping = 1;
  const Grid& grid = scene.setup.body.grid;
  const auto in_layer = [&](int32_t i) {
    return grid.coordinates(scene.setup.body.node[at(i)])[0] == grid.coordinates(scene.setup.body.node[0])[0] + 3;
  };
  Lists lists;
  for (const auto& box : box_clusters(7, 4, 4, 2)) {
    Lists::value_type left, right;
    for (const int32_t i : box) {
      if (!in_layer(i)) (i % 7 < 3 ? left : right).push_back(i);
    }
    for (auto& side : {left, right}) {
      if (!side.empty()) lists.push_back(side);
    }
  }
  scene.before = state_of(scene.setup.body, lists);
  for (std::size_t i = 0; i < scene.before.x.size(); ++i) {
    scene.before.alive[i] = in_layer(static_cast<int32_t>(i)) ? 0 : 1;
    Vec3& x = scene.before.x[i];
    x.x *= 1.1;
    scene.before.v[i] = {0.3 - 4 * x.y, 4 * x.x, -0.5};
  }
  scene.after = scene.before;
  reference::step(scene.setup, scene.after);
  return scene;
}

// Pulls the pieces together, as a force of `weights` times the weight of one of them would throughout the frame.
void attract(ThrownBlock& scene, double weights) {
  const double speed = weights * 9.81 * scene.setup.step.substeps * scene.setup.substep_length[0];
  for (std::size_t i = 0; i < scene.after.v.size(); ++i) {
    if (scene.after.alive[i]) scene.after.v[i].x += i % 7 < 3 ? speed : -speed;
  }
}

TEST(ComponentMomentum, HoldsForPiecesThatFallEachByItself) {
  const ThrownBlock scene = two_pieces();
  const Verdict verdict = component_momentum(scene.setup, scene.before, scene.after);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.checked, 2 * 3) << "pieces and axes";
  EXPECT_GT(verdict.bound, 0);
}

TEST(ComponentMomentum, RejectsAnAttractionThatTheWholeBodyDoesNotShow) {
  ThrownBlock scene = two_pieces();
  attract(scene, 1e-9);
  EXPECT_TRUE(momentum(scene.setup, scene.before, scene.after).holds) << "what one piece gains the other loses";
  const Verdict verdict = component_momentum(scene.setup, scene.before, scene.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{0});
  EXPECT_NE(verdict.witness.text.find("the component of particle 0 (48 particles, one of 2 components)"),
            std::string::npos)
      << verdict.witness.text;
}

TEST(ComponentMomentum, RejectsAHundredthOfAWeightInSinglePrecision) {
  ThrownBlock scene = two_pieces();
  scene.before.precision = scene.after.precision = Precision::binary32;
  ASSERT_TRUE(component_momentum(scene.setup, scene.before, scene.after).holds);
  attract(scene, 0.01);
  EXPECT_FALSE(component_momentum(scene.setup, scene.before, scene.after).holds);
}

TEST(ComponentMomentum, AsksOnlyOfWhatNothingHoldsAndNothingHasPushed) {
  ThrownBlock scene = two_pieces();
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = -1, .friction = 0}};
  EXPECT_EQ(component_momentum(scene.setup, scene.before, scene.after).checked, 2 * 3) << "it was not touched";
  scene.after.impulse.z = 1e-9;
  EXPECT_EQ(component_momentum(scene.setup, scene.before, scene.after).checked, 2 * 2);
  scene.after.impulse = {};
  scene.setup.grips = {{.particles = {0}, .active = {0, 0, 1, 0}, .displacement = {4, Vec3{}}}};
  EXPECT_EQ(component_momentum(scene.setup, scene.before, scene.after).checked, 3) << "the other one is free";
  scene.setup.walls[0].friction = 0.1;
  EXPECT_EQ(component_momentum(scene.setup, scene.before, scene.after).checked, 1) << "along the wall's own axis";
}

TEST(ComponentMomentum, SaysWhyItAsksNothingOfOnePiece) {
  const ThrownBlock scene = thrown_block(Solver::implicit);
  const Verdict verdict = component_momentum(scene.setup, scene.before, scene.after);
  EXPECT_TRUE(verdict.holds);
  EXPECT_EQ(verdict.vacuous, "one component, or none that nothing holds or pushes");
}

}  // namespace
}  // namespace cutproof::oracles::step_test
