// What a step touched, of bodies of one or two particles at known places.
#include "property_tests/touching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "property_tests/cases.h"

namespace cutproof::property_tests::touching_test {
namespace {

// Two neighbours at rest far from everything, and one frame of one substep in which the blade (2 × 2 spacings, in the
// plane z = 0, from y = 0 to the back at y = 2) stands still. ρ is 1.001 · 0.75.
struct Scene {
  Setup setup;
  State before, after;
};
Scene scene() {
  Case c;
  c.nodes = {{0, 0, 0}, {1, 0, 0}};
  c.moves = true;
  c.substeps = 1;
  c.blade_length = c.blade_depth = 8;
  c.blade_friction = 1;
  c.strokes = {{{0, 0, 0}, {0, 0, 0}, 2, true, Link::apart}};
  Instance loaded = instance_of(c);
  for (BladeMove& move : loaded.setup.blade_moves) move.from = move.to = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (Vec3& x : loaded.state.x) x = {50, 50, 50};
  return {loaded.setup, loaded.state, loaded.state};
}
const double kClearance = blade_clearance(scene().setup);

// A particle that has come to a place, without sliding.
Touches at_place(Vec3 x, Vec3 start) {
  Scene s = scene();
  s.before.x[0] = start;
  s.after.x[0] = x;
  return touches_of(s.setup, s.before, s.after);
}
Touches at_place(Vec3 x) { return at_place(x, x); }

struct Expected {
  bool face = false, rim = false, side = false, edge = false, back = false, border = false, led = false;
};
void expect_touches(const Touches& found, const Expected& expected, const char* where) {
  EXPECT_EQ(found.blade_face, expected.face) << where;
  EXPECT_EQ(found.blade_rim, expected.rim) << where;
  EXPECT_EQ(found.blade_side, expected.side) << where;
  EXPECT_EQ(found.cutting_edge, expected.edge) << where;
  EXPECT_EQ(found.blade_back, expected.back) << where;
  EXPECT_EQ(found.on_a_border, expected.border) << where;
  EXPECT_EQ(found.led_round, expected.led) << where;
}

TEST(Touching, KnowsFaceRimSideEdgeAndBack) {
  const double r = kClearance, d = r / std::sqrt(2);
  expect_touches(at_place({0, 1, r}), {.face = true}, "over the plate");
  expect_touches(at_place({0, 1, -r}), {.face = true}, "under it");
  expect_touches(at_place({0, 1, r * 1.01}), {}, "above it, without touching");
  expect_touches(at_place({0, 1, r * 0.9}), {}, "where nothing can stand");
  expect_touches(at_place({1 + d, 1, d}), {.rim = true, .side = true}, "round the right side");
  expect_touches(at_place({-1 - r, 1, 0}), {.rim = true, .side = true}, "left of it");
  expect_touches(at_place({0, -d, d}), {.rim = true, .edge = true}, "before the edge");
  expect_touches(at_place({0, 2 + d, -d}), {.rim = true, .back = true}, "behind the back");
  const double e = r / std::sqrt(3);
  expect_touches(at_place({1 + e, -e, e}), {.rim = true, .side = true, .edge = true}, "round a corner");
  expect_touches(at_place({1, 1, r}), {.face = true, .side = true, .border = true}, "over the border");
  expect_touches(at_place({1, 1, 1.5 * r}, {1, 1, 2 * r}), {.side = true, .border = true}, "farther from the plane");
  expect_touches(at_place({1, 1, -1.5 * r}, {0, 1, r}), {.side = true, .border = true, .led = true}, "led round");
  expect_touches(at_place({1, 1, 5 * r}), {}, "over the border by chance");
}

TEST(Touching, SeesOnlyABladeThatIsThere) {
  for (int way = 0; way < 4; ++way) {
    Scene s = scene();
    s.before.x[0] = s.after.x[0] = {0, 1, kClearance};
    if (way == 1) s.setup.blade_moves[0].down = false;
    if (way == 2) s.setup.detect.criterion = Criterion::geometric;
    if (way == 3) s.before.alive[0] = 0;
    EXPECT_EQ(touches_of(s.setup, s.before, s.after).blade_face, way == 0) << way;
  }
}

TEST(Touching, KnowsWallsAndBladeAtOnce) {
  Scene s = scene();
  s.setup.walls = {{2, -1, kClearance, 0}};
  s.after.x[0] = {40, 40, kClearance};
  s.before.x = s.after.x;
  Touches found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.wall && found.wall_that_is_no_floor && !found.blade_and_wall);
  s.after.x[0] = {0, 1, kClearance};
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.wall && found.blade_face && found.blade_and_wall);
  // Each by another particle is not at once.
  s.after.x = {{0, 1, -kClearance}, {40, 40, kClearance}};
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.wall && found.blade_face && !found.blade_and_wall);
  s.setup.walls = {{2, +1, kClearance, 0}};
  s.after.x = {{40, 40, kClearance}, {50, 50, 50}};
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.wall && !found.wall_that_is_no_floor) << "a floor";
}

// Particle 0 on a surface, which slid by `own` in the last substep, and its neighbour by `others` [h].
Touches rubbed(double own, double others, bool on_blade, double friction, double damping = 0) {
  Scene s = scene();
  s.setup.step.damping = damping;
  s.setup.blade.friction = friction;
  s.setup.walls = {{2, -1, 30, friction}};
  s.after.x[0] = on_blade ? Vec3{0, 1, kClearance} : Vec3{40, 40, 30};
  const double dt = s.setup.substep_length[0], decay = std::exp(-damping * dt);
  s.after.v[0] = {own * decay / dt, 0, 0};
  s.after.v[1] = {others * decay / dt, 0, 0};
  return touches_of(s.setup, s.before, s.after);
}

TEST(Touching, KnowsWhatSlidesAndWhatSticksAgainstAPull) {
  for (const bool on_blade : {false, true}) {
    for (const double damping : {0.0, 5000.0}) {
      EXPECT_TRUE(rubbed(0.01, 0, on_blade, 0.3, damping).slides);
      EXPECT_FALSE(rubbed(0.01, 0.01, on_blade, 0.3, damping).sticks);
      EXPECT_TRUE(rubbed(0, 0.01, on_blade, 0.3, damping).sticks);
      EXPECT_FALSE(rubbed(0, 0.01, on_blade, 0.3, damping).slides);
    }
    EXPECT_FALSE(rubbed(0, 0, on_blade, 0.3).sticks) << "nothing pulls";
    EXPECT_FALSE(rubbed(0.01, 0, on_blade, 0).slides) << "without friction";
    EXPECT_FALSE(rubbed(0, 0.01, on_blade, 0).sticks) << "without friction";
  }
}

// What a moving blade carries along does not slide on it.
TEST(Touching, CountsSlidingAgainstTheBladeAsItMoves) {
  Scene s = scene();
  const double dt = s.setup.substep_length[0];
  s.setup.blade_moves[0].from.edge = {-0.1, 0, 0};
  s.after.x[0] = {0, 1, kClearance};
  s.after.v[0] = {0.1 / dt, 0, 0};
  Touches found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.sticks && !found.slides) << "its neighbour stays, so it is left behind";
  s.after.v[0] = {};
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.slides && !found.sticks);
}

TEST(Touching, KnowsWhatGripsHoldAndHaveHeld) {
  Scene s = scene();
  const auto substeps = s.setup.blade_moves.size();
  ASSERT_EQ(substeps, 1u);
  s.setup.grips = {{{0}, {1}, {Vec3{}}}};
  s.after.x[0] = {0, 1, kClearance};
  Touches found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.held && !found.released);
  EXPECT_FALSE(found.blade_face) << "what is held touches nothing";
  s.setup.grips[0].active = {0};
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_FALSE(found.held || found.released) << "never held";
  // A second frame.
  s.setup.blade_moves.push_back(s.setup.blade_moves[0]);
  s.setup.substep_length.push_back(s.setup.substep_length[0]);
  s.setup.grips[0].active = {1, 0};
  s.setup.grips[0].displacement.push_back({});
  s.before.frame = 1;
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.released && !found.held);
  // Another grip has it now.
  s.setup.grips.push_back({{0}, {0, 1}, {Vec3{}, Vec3{}}});
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_TRUE(found.taken_over && found.held && !found.released);
  s.setup.grips.pop_back();
  s.before.alive[0] = 0;
  found = touches_of(s.setup, s.before, s.after);
  EXPECT_FALSE(found.released) << "it is gone";
}

}  // namespace
}  // namespace cutproof::property_tests::touching_test
