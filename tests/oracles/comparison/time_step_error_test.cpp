// The distance to shorter time steps where it is known by hand.
#include "oracles/comparison/time_step_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::time_step_error_test {
namespace {

using tests::block_body;
using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;

// In free fall from rest, n substeps of dt go g dt² n (n + 1) / 2; 8 n of dt / 8 go 7 n / 16 · g dt² less.
TEST(TimeStepError, OfFreeFallIsKnown) {
  cutproof::Setup setup = setup_of(tests::body_of({{0, 0, 0}}, kH), 5);
  setup.step.gravity = {0, 0, -9.81};
  const State state = state_of(setup.body, {{0}});
  const TimeStepError error = time_step_error(reference::make_backend, setup, state, 100);
  ASSERT_EQ(error.position.size(), 5u);
  EXPECT_FALSE(error.first_difference);
  for (std::size_t frame = 0; frame < 5; ++frame) {
    const double n = 4.0 * static_cast<double>(frame + 1);
    const double truth = 7 * n / 16 * 9.81 * 0.004 * 0.004 / kH;
    EXPECT_NEAR(error.position[frame].rms(), truth, 1e-12);
    EXPECT_NEAR(error.position[frame].max, truth, 1e-12);
  }
  EXPECT_NEAR(error.greatest_rms(), 7 * 20.0 / 16 * 9.81 * 0.004 * 0.004 / kH, 1e-12);
  EXPECT_EQ(time_step_error(reference::make_backend, setup, state, 2).position.size(), 2u);
}

// The lower of two particles falls away from the upper one, which is held. After frame 2 (12 substeps) it has gone
// 78 g dt² in the coarse run and 72.75 g dt² in the fine one: εh lies between.
TEST(TimeStepError, EndsAtTheFirstRemovalThatDiffers) {
  cutproof::Setup setup = setup_of(tests::body_of({{0, 0, 0}, {0, 0, 1}}, kH), 5);
  setup.detect.without_blade = true;
  setup.step.gravity = {0, 0, -0.5 * kH / 75 / (0.004 * 0.004)};
  setup.grips = {{{1}, std::vector<uint8_t>(20, 1), std::vector<Vec3>(20)}};
  const State state = state_of(setup.body, {{0}, {1}});
  const TimeStepError error = time_step_error(reference::make_backend, setup, state, 5);
  EXPECT_EQ(error.position.size(), 2u);
  EXPECT_EQ(error.first_difference, 2);
  EXPECT_EQ(error.removed_otherwise, 0);
}

TEST(TimeStepError, MoreSubstepsPassTheSamePlaces) {
  cutproof::Setup setup = setup_of(block_body(2, 2, 2, kH), 1);
  setup.has_blade = true;
  setup.blade = {1, 1, 0, 0};
  // A quarter turn about z in four substeps, and a step aside.
  const auto pose = [](int k) {
    const double a = k * M_PI / 8;
    return BladePose{{0.1 * k, 0, 0}, {std::cos(a), std::sin(a), 0}, {0, 0, 1}};
  };
  for (int k = 0; k < 4; ++k) setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
  setup.grips = {{{3}, {1, 0, 1, 1}, {{0, 0, 0.8}, {}, {0.8, 0, 0}, {}}}};
  const cutproof::Setup finer = with_more_substeps(setup, 8);
  EXPECT_EQ(finer.step.substeps, 32);
  EXPECT_EQ(finer.substep_length[0], 0.0005);
  ASSERT_EQ(finer.blade_moves.size(), 32u);
  for (std::size_t k = 0; k < 32; ++k) {
    const double a = static_cast<double>(k) / 8 * M_PI / 8;
    const BladePose& from = finer.blade_moves[k].from;
    EXPECT_NEAR(norm(from.along - Vec3{std::cos(a), std::sin(a), 0}), 0, 1e-14);
    EXPECT_NEAR(norm(from.back - Vec3{0, 0, 1}), 0, 1e-14);
    EXPECT_NEAR(from.edge.x, 0.1 * static_cast<double>(k) / 8, 1e-14);
    EXPECT_TRUE(k == 0 || from == finer.blade_moves[k - 1].to) << "no gap";
    EXPECT_TRUE(finer.blade_moves[k].down);
  }
  ASSERT_EQ(finer.grips[0].active.size(), 32u);
  Vec3 way;
  int active = 0;
  for (std::size_t k = 0; k < 32; ++k) {
    way += finer.grips[0].displacement[k];
    active += finer.grips[0].active[k];
  }
  EXPECT_EQ(active, 24);
  EXPECT_NEAR(norm(way - Vec3{0.8, 0, 0.8}), 0, 1e-14);
}

}  // namespace
}  // namespace cutproof::oracles::time_step_error_test
