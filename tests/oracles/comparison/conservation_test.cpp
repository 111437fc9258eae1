// A free body keeps what it must, and what it loses is seen.
#include "oracles/comparison/conservation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "gpu/backends.h"
#include "oracles/comparison/solver_error.h"
#include "oracles/comparison/time_step_error.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::conservation_test {
namespace {

using tests::block_body;
using tests::box_clusters;
using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;

struct Moving {
  cutproof::Setup setup;
  State state;
};

constexpr int64_t kFrames = 1000;

// A block of 7 × 5 × 4 particles in motion, alone.
Moving free_block(int64_t frames) {
  Moving scene{setup_of(block_body(7, 5, 4, kH)), {}};
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.step.damping = 3;
  scene.setup = free_setup(scene.setup, 0, frames);
  scene.state = state_of(scene.setup.body, box_clusters(7, 5, 4, 3));
  set_in_motion(scene.setup, scene.state);
  return scene;
}

void print(const char* name, const Conservation& c) {
  std::printf(
      "%s, %ld substeps: momentum %.3g m/s per mass (bound %.3g), %.3g of sum m|v|; energy +%.3g (bound %.3g); angular "
      "momentum %.3g\n",
      name, static_cast<long>(c.substeps), c.momentum, c.momentum_bound, c.momentum_relative, c.energy.value_or(-1),
      c.energy_bound, c.angular_momentum);
}

TEST(Conservation, TheReferenceKeepsMomentumAndGainsNoEnergyOver1000Frames) {
  const auto backend = reference::make_backend();
  const Moving scene = free_block(kFrames);
  const Conservation found = conservation(*backend, scene.setup, scene.state);
  print("reference", found);
  EXPECT_EQ(found.substeps, 4 * kFrames);
  EXPECT_LE(found.momentum_relative, 1e-10);
  EXPECT_LE(found.momentum, found.momentum_bound);
  EXPECT_EQ(found.mass, 0);
  EXPECT_LE(found.energy.value(), found.energy_bound);
  EXPECT_GT(found.angular_momentum, 0) << "it was spinning, and implicit Euler damps that";
}

TEST(Conservation, TheKernelsKeepMomentumAndGainNoEnergyOver1000Frames) {
  const auto backend = gpu::make_host_backend();
  const Moving scene = free_block(kFrames);
  const Conservation found = conservation(*backend, scene.setup, scene.state);
  print("host", found);
  EXPECT_EQ(backend->precision(), Precision::binary32);
  EXPECT_LE(found.momentum, found.momentum_bound);
  EXPECT_EQ(found.mass, 0);
  EXPECT_LE(found.energy.value(), found.energy_bound);
}

// A backend that gives every particle a little velocity in every frame.
class Leaking final : public Backend {
 public:
  explicit Leaking(double leak) : leak_(leak) {}
  std::string name() const override { return "leaking"; }
  bool can_run(Span span) const override { return inner_->can_run(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    inner_->run(span);
    auto states = inner_->snapshot();
    for (Vec3& v : states[0].v) v.x += leak_;
    inner_->load(setups_, std::move(states));
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return inner_->report(); }

 private:
  double leak_;
  std::vector<Setup> setups_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
};

TEST(Conservation, ALeakIsSeen) {
  Leaking backend(1e-9);
  const Moving scene = free_block(100);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_NEAR(found.momentum, 100 * 1e-9, 1e-12);
  EXPECT_GT(found.momentum_relative, 1e-10);
  EXPECT_GT(found.momentum, found.momentum_bound);
}

TEST(Conservation, WhatIsNotANumberIsNotConserved) {
  Leaking backend(std::nan(""));
  const Moving scene = free_block(3);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_TRUE(std::isinf(found.momentum));
  EXPECT_TRUE(std::isinf(found.momentum_relative));
  EXPECT_TRUE(std::isinf(found.mass));
  EXPECT_TRUE(std::isinf(found.energy.value()));
  const TimeStepError time_step =
      time_step_error([] { return std::make_unique<Leaking>(std::nan("")); }, scene.setup, scene.state, 3);
  ASSERT_EQ(time_step.position.size(), 1u) << "there is nothing to compare any more";
  EXPECT_TRUE(std::isinf(time_step.greatest_rms()));
  EXPECT_TRUE(std::isinf(solver_error(backend, scene.setup, scene.state)->position.max));
}

TEST(Conservation, GrowingEnergyIsSeen) {
  Leaking backend(1e-3);
  const Moving scene = free_block(100);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_GT(found.energy.value(), found.energy_bound);
  EXPECT_GT(*found.energy, 0.1);
}

TEST(Conservation, AFreeBodyMeetsNothing) {
  cutproof::Setup setup = setup_of(block_body(3, 3, 3, kH), 2);
  setup.substep_length = {0.004, 0.002};
  setup.walls = {{}};
  setup.grips = {{{0}, std::vector<uint8_t>(8, 1), std::vector<Vec3>(8)}};
  setup.step.gravity = {0, 0, -1};
  setup.step.damping = 1;
  const cutproof::Setup free = free_setup(setup, 1, 7);
  EXPECT_EQ(free.substep_length, std::vector<double>(7, 0.002));
  EXPECT_TRUE(free.walls.empty() && free.grips.empty() && !free.has_blade);
  EXPECT_EQ(free.step.gravity, Vec3{});
  EXPECT_EQ(free.step.damping, 0);
  EXPECT_FALSE(needs_detection(free));
}

}  // namespace
}  // namespace cutproof::oracles::conservation_test
