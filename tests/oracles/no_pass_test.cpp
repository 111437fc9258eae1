// Tissue that stands across the blade is rejected.
#include <gtest/gtest.h>

#include <functional>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::no_pass_test {
namespace {

using namespace cutproof::tests;

// A 4 × 1 × 3 sheet in the plane y = 1; the blade stands across it at the end of the frame, at x = 2.5, edge along y,
// back upwards, from z = 2 on.
struct Pressed {
  Pressed() : setup(setup_of(block_body(4, 1, 3))), state(state_of(setup.body, {range(0, 12)})) {
    setup.has_blade = true;
    setup.blade = {2.0, 5.0, 0.1, 0};
    const BladePose pose = {{2.5, 1, 2}, {0, 1, 0}, {0, 0, 1}};
    setup.blade_moves.assign(4, BladeMove{pose, pose, true, 0});
  }
  Setup setup;
  State state;
};

TEST(NoPass, RejectsTissueThatStandsAcrossTheBlade) {
  const Pressed pressed;
  const Verdict verdict = no_pass(pressed.setup, pressed.state);
  // Rows at z = 1, 2, 3; particles 5-6 meet the cutting edge itself, 9-10 the blade; 1-2 pass under it.
  expect_rejected(verdict, {}, {5, 6});
  EXPECT_EQ(verdict.measured, 2);
  EXPECT_EQ(verdict.checked, 3 * 3 + 2 * 4);
}

TEST(NoPass, AcceptsTissueThatWasCut) {
  Pressed pressed;
  remove_particles(pressed.state, {5, 6, 9, 10});
  expect_holds(no_pass(pressed.setup, pressed.state));
}

TEST(NoPass, AcceptsABladeBesideAndBehindTheTissue) {
  Pressed pressed;
  for (auto& move : pressed.setup.blade_moves) move.to.edge.z = 3.01;
  expect_holds(no_pass(pressed.setup, pressed.state));
  for (auto& move : pressed.setup.blade_moves) move.to.edge = {2.5, 1, -5};  // its back ends at z = 0
  expect_holds(no_pass(pressed.setup, pressed.state));
  for (auto& move : pressed.setup.blade_moves) move.to.edge = {2.5, 2.5, 2};  // along y from 1.5 on
  expect_holds(no_pass(pressed.setup, pressed.state));
}

TEST(NoPass, RejectsAnEdgeThatLiesWithinTheBladesPlane) {
  Pressed pressed;
  for (auto& move : pressed.setup.blade_moves) move.to.edge.x = 3;  // through particles 2, 6, 10
  const Verdict verdict = no_pass(pressed.setup, pressed.state);
  EXPECT_FALSE(verdict.holds);
  // 2-6 and 6-10 lie in the plane; 5-6, 6-7, 9-10, 10-11 end on it.
  EXPECT_EQ(verdict.measured, 6);
}

TEST(NoPass, LooksAtTheEndOfTheFrame) {
  Pressed pressed;
  pressed.setup.blade_moves[3].to.edge.z = 10;
  expect_holds(no_pass(pressed.setup, pressed.state));
}

TEST(NoPass, ExemptsWhatIsHeld) {
  Pressed pressed;
  pressed.setup.grips.push_back({{5, 9}, {0, 0, 0, 1}, std::vector<Vec3>(4)});
  expect_holds(no_pass(pressed.setup, pressed.state));
  pressed.setup.grips[0].active = {1, 1, 1, 0};  // let go in the last substep
  EXPECT_FALSE(no_pass(pressed.setup, pressed.state).holds);
}

TEST(NoPass, IsVacuousWithoutADynamicCut) {
  const auto vacuous = [](const std::function<void(Pressed&)>& change) {
    Pressed pressed;
    change(pressed);
    const Verdict verdict = no_pass(pressed.setup, pressed.state);
    expect_holds(verdict);
    EXPECT_EQ(verdict.checked, 0);
  };
  vacuous([](Pressed& p) { p.setup.detect.criterion = Criterion::geometric; });
  vacuous([](Pressed& p) { p.setup.detect.criterion = Criterion::strain; });
  vacuous([](Pressed& p) { p.setup.detect.criterion = Criterion::none; });
  vacuous([](Pressed& p) { p.setup.blade_moves[3].down = false; });
  vacuous([](Pressed& p) { p.setup.has_blade = false; });
  vacuous([](Pressed& p) { p.state.frame = 1; });  // the schedule is over
}

}  // namespace
}  // namespace cutproof::oracles::no_pass_test
