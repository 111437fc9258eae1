// Contacts with blade and walls, against a brute-force search for the nearest allowed point.
#include "reference_cpu/contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace cutproof::reference::contacts_test {
namespace {

Setup with_blade(double length, double depth, double thickness) {
  cutproof::Setup setup;
  setup.body.grid.spacing = 1;
  setup.has_blade = true;
  setup.blade = {length, depth, thickness, 0};
  return setup;
}

// The blade stands in the plane y = 0, its edge along x at z = 0, its back upwards.
const BladeMove kStanding = {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, true, 0};

// Written down from method.md's words: nearer than ρ to the rectangle, or over it on the other side.
bool forbidden(const Setup& setup, Vec3 x, int side) {
  const double rho = blade_clearance(setup);
  const double n = -x.y;  // along × back = (1,0,0) × (0,0,1) = (0,-1,0)
  const double u = std::max(std::abs(x.x) - setup.blade.length / 2, 0.0);
  const double w = std::max({-x.z, x.z - setup.blade.depth, 0.0});
  const bool near = std::sqrt(u * u + w * w + n * n) < rho * (1 - 1e-12);
  const bool over = std::abs(x.x) < setup.blade.length / 2 && x.z > 0 && x.z < setup.blade.depth;
  return near || (over && side * n < 0);
}

TEST(BladeContact, GivesAnAllowedPointThatNoSampledAllowedPointIsNearerThan) {
  const cutproof::Setup setup = with_blade(4, 3, 1.0);
  const Contacts contacts(setup, &kStanding);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> wide(-4, 4), unit(-1, 1);
  int moved = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3 x = {wide(random), 0.6 * unit(random), wide(random)};
    for (const int side : {+1, -1}) {
      const Vec3 answer = contacts.project(x, side);
      EXPECT_FALSE(forbidden(setup, answer, side)) << x.x << " " << x.y << " " << x.z;
      if (answer == x) {
        EXPECT_FALSE(forbidden(setup, x, side));
        continue;
      }
      ++moved;
      const double distance = norm(answer - x);
      for (int sample = 0; sample < 2000; ++sample) {
        // Uniform in the ball that the answer leaves no allowed point in.
        Vec3 offset = {unit(random), unit(random), unit(random)};
        if (norm(offset) >= 1) continue;
        offset = (distance * (1 - 1e-9)) * offset;
        EXPECT_TRUE(forbidden(setup, x + offset, side)) << "nearer than the answer by " << distance - norm(offset);
      }
    }
  }
  EXPECT_GT(moved, 50);
}

TEST(BladeContact, IsTheIdentityOnWhatItHasProjected) {
  const cutproof::Setup setup = with_blade(4, 3, 0.2);
  const Contacts contacts(setup, &kStanding);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> wide(-4, 4);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 once = contacts.project({wide(random), 0.4 * wide(random), wide(random)}, +1);
    EXPECT_LE(norm(contacts.project(once, +1) - once), 1e-14);
  }
}

TEST(BladeContact, TakesTheSideFromWhereTheParticleWasWhenTheSubstepBegan) {
  const cutproof::Setup setup = with_blade(4, 3, 0.2);
  // The blade moves by 1 in its normal's direction, past a particle that stands still.
  BladeMove move = kStanding;
  move.to.edge = {0, -1, 0};
  const Contacts contacts(setup, &move);
  const Vec3 particle = {0.3, -0.5, 1.5};
  EXPECT_EQ(contacts.side(particle), +1);
  EXPECT_EQ(contacts.side({0, 0.5, 1}), -1);
  EXPECT_EQ(contacts.side({0, 0, 1}), +1) << "a tie goes to the positive normal";
  const Vec3 pushed = contacts.project(particle, contacts.side(particle));
  EXPECT_NEAR(pushed.y, -1 - blade_clearance(setup), 1e-14) << "carried along in front of the blade";
}

TEST(BladeContact, LetsNothingHappenWhileTheBladeIsUpOrOnlySweeps) {
  cutproof::Setup setup = with_blade(4, 3, 1);
  EXPECT_FALSE(Contacts(setup, nullptr).any());
  setup.detect.criterion = Criterion::geometric;
  EXPECT_FALSE(Contacts(setup, &kStanding).any());
}

TEST(WallContact, ClampsToEveryWallAtOnce) {
  cutproof::Setup setup;
  setup.walls = {{2, +1, 0.0, 0}, {0, -1, 2.0, 0}};
  const Contacts contacts(setup, nullptr);
  EXPECT_EQ(contacts.project({3, 7, -1}, +1), (Vec3{2, 7, 0}));
  EXPECT_EQ(contacts.project({1, 7, 1}, +1), (Vec3{1, 7, 1}));
}

TEST(WallContact, RubsAgainstSlidingUpToTheCoulombBound) {
  cutproof::Setup setup;
  setup.walls = {{2, +1, 0.0, 0.5}};
  const Contacts contacts(setup, nullptr);
  // Pressed in by 0.2: up to 0.1 of sliding is taken back.
  const Vec3 sticks = contacts.project_with_friction({0.05, 0, -0.2}, +1, {0, 0, 0});
  EXPECT_NEAR(sticks.x, 0, 1e-15);
  const Vec3 slides = contacts.project_with_friction({1, 0, -0.2}, +1, {0, 0, 0});
  EXPECT_NEAR(slides.x, 0.9, 1e-15);
  EXPECT_EQ(slides.z, 0);
}

TEST(BladeContact, DragsAParticleAlongByFriction) {
  cutproof::Setup setup = with_blade(4, 3, 0.2);
  setup.blade.friction = 10;
  BladeMove move = kStanding;
  move.to.edge = {0.5, 0, 0};  // slides in its own plane
  const Contacts contacts(setup, &move);
  const Vec3 start = {0, -blade_clearance(setup), 1};
  const Vec3 dragged = contacts.project_with_friction({0, -blade_clearance(setup) + 0.1, 1}, +1, start);
  EXPECT_NEAR(dragged.x, 0.5, 1e-14) << "sticks to the blade";
}

TEST(Contacts, KeepTheBladesClearanceWhereAWallHoldsAsWell) {
  cutproof::Setup setup = with_blade(4, 3, 0.2);
  setup.walls = {{2, +1, -0.3, 0}};
  const Contacts contacts(setup, &kStanding);
  const Vec3 squeezed = contacts.project({0, -0.1, -0.2}, +1);
  EXPECT_GE(std::hypot(squeezed.y, squeezed.z), blade_clearance(setup) * (1 - 1e-12));
  EXPECT_GE(squeezed.z, -0.3 - 0.05) << "the wall is met up to what the turns leave";
}

}  // namespace
}  // namespace cutproof::reference::contacts_test
