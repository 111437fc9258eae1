// Stage step: what follows from its equations by hand, on small bodies.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference::step_test {
namespace {

Setup setup_of(Body body, int64_t frames, double dt) {
  cutproof::Setup setup;
  setup.body = std::move(body);
  setup.substep_length.assign(static_cast<std::size_t>(frames), dt);
  return setup;
}

State cooked(const Setup& setup, int side = 3) {
  ClusterSpec spec;
  spec.side = side;
  return fixtures::cook(setup.body, spec, setup.expand, setup.merge, 1);
}

void perturb(const Setup& setup, State& state, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double h = setup.body.grid.spacing;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.x[i] += (0.1 * h) * Vec3{normal(random), normal(random), normal(random)};
    state.v[i] = (3 * h) * Vec3{normal(random), normal(random), normal(random)};
  }
}

Vec3 total_momentum(const Setup& setup, const State& state) {
  Vec3 sum;
  for (std::size_t i = 0; i < state.v.size(); ++i) {
    if (state.alive[i]) sum += setup.body.mass[i] * state.v[i];
  }
  return sum;
}

double total_size(const Setup& setup, const State& state) {
  double sum = 0;
  for (std::size_t i = 0; i < state.v.size(); ++i) sum += setup.body.mass[i] * norm(state.v[i]);
  return sum;
}

TEST(Step, LeavesTheRestStateWhereItIs) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    cutproof::Setup setup = setup_of(fixtures::block(7, 6, 5, 0.01), 5, 0.004);
    setup.step.solver = solver;
    State state = cooked(setup);
    const std::vector<Vec3> rest = state.x;
    for (int frame = 0; frame < 5; ++frame) {
      step(setup, state);
      ++state.frame;
    }
    // Each of the 80 iterations rounds t_c, g_i and x_i, a few units of 2^-53 of the body's 0.07 m each.
    for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_LE(norm(state.x[i] - rest[i]), 80 * 4 * 0x1p-53 * 0.07);
  }
}

TEST(Step, MovesAFreeParticleAsImplicitEulerDoes) {
  // One particle in one cluster: g = x, so the solver changes nothing.
  cutproof::Setup setup = setup_of(fixtures::block(1, 1, 1, 0.01), 3, 0.01);
  setup.step.gravity = {0, 0, -9.81};
  setup.step.damping = 0.5;
  State state = cooked(setup);
  double v = 0, z = state.x[0].z;
  for (int frame = 0; frame < 3; ++frame) {
    step(setup, state);
    ++state.frame;
    for (int s = 0; s < setup.step.substeps; ++s) {
      const double moved = 0.01 * v - 0.01 * 0.01 * 9.81;
      z += moved;
      v = std::exp(-0.5 * 0.01) * moved / 0.01;
    }
  }
  EXPECT_NEAR(state.x[0].z, z, 1e-14);
  EXPECT_NEAR(state.v[0].z, v, 1e-12);
}

TEST(Step, ReproducesARigidTranslation) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    cutproof::Setup setup = setup_of(fixtures::block(6, 5, 4, 0.01), 1, 0.004);
    setup.step.solver = solver;
    State state = cooked(setup);
    const std::vector<Vec3> rest = state.x;
    const Vec3 velocity = {0.3, -0.2, 0.7};
    for (Vec3& v : state.v) v = velocity;
    step(setup, state);
    for (std::size_t i = 0; i < rest.size(); ++i) {
      EXPECT_LE(norm(state.x[i] - rest[i] - 0.016 * velocity), 1e-15);
      EXPECT_LE(norm(state.v[i] - velocity), 1e-12);
    }
  }
}

TEST(Step, ConservesLinearMomentumTo1e12) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const double stiffness : {1e3, 1e5, 1e7}) {
      cutproof::Setup setup = setup_of(fixtures::block(9, 8, 7, 0.01), 1, 0.004);
      setup.step.solver = solver;
      setup.step.stiffness = stiffness;
      setup.step.iterations = 30;
      State state = cooked(setup);
      perturb(setup, state, 5);
      const Vec3 before = total_momentum(setup, state);
      const double size = total_size(setup, state);
      step(setup, state);
      EXPECT_LE(norm(total_momentum(setup, state) - before), 1e-12 * size) << stiffness;
      EXPECT_LE(norm(state.impulse), 1e-12 * size) << "nothing touched it";
    }
  }
}

TEST(Step, AccountsForWhatContactsAndGripsGive) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    cutproof::Setup setup = setup_of(fixtures::block(8, 8, 6, 0.01), 1, 0.004);
    setup.step.solver = solver;
    setup.step.damping = 3;
    setup.step.gravity = {0, 1, -9.81};
    setup.walls = {{2, +1, 0.012, 0.4}};
    setup.has_blade = true;
    setup.blade = {0.2, 0.1, 0.001, 0.2};
    const BladePose pose = {{0.045, 0.045, 0.055}, {1, 0, 0}, {0, 0, 1}};
    setup.blade_moves.assign(4, {pose, pose, true, 0});
    Grip grip;
    grip.particles = {0, 1, 2, 3};
    grip.active.assign(4, 1);
    grip.displacement.assign(4, {0, 0, 1e-3});
    setup.grips = {grip};
    State state = cooked(setup);
    perturb(setup, state, 6);
    const Vec3 before = total_momentum(setup, state);
    double mass = 0;
    for (const double m : setup.body.mass) mass += m;
    step(setup, state);

    Vec3 expected = before;
    for (int s = 0; s < 4; ++s) expected = std::exp(-3 * 0.004) * (expected + 0.004 * mass * setup.step.gravity);
    expected += state.impulse;
    EXPECT_GT(norm(state.impulse), 0);
    EXPECT_LE(norm(total_momentum(setup, state) - expected), 1e-12 * (total_size(setup, state) + norm(state.impulse)));
  }
}

TEST(Step, CarriesHeldParticlesAlongTheirPath) {
  cutproof::Setup setup = setup_of(fixtures::block(6, 4, 4, 0.01), 2, 0.004);
  Grip grip;
  grip.particles = {0, 6, 12};
  grip.active = {1, 1, 1, 1, 0, 0, 0, 0};
  grip.displacement.assign(8, {-1e-3, 0, 2e-3});
  setup.grips = {grip};
  State state = cooked(setup);
  const std::vector<Vec3> rest = state.x;
  step(setup, state);
  for (const int32_t i : grip.particles) {
    const auto p = static_cast<std::size_t>(i);
    EXPECT_LE(norm(state.x[p] - rest[p] - Vec3{-4e-3, 0, 8e-3}), 1e-16);
  }
  EXPECT_GT(norm(state.x[1] - rest[1]), 1e-4) << "the rest of the body is pulled along";
  ++state.frame;
  const Vec3 released = state.x[0];
  step(setup, state);
  EXPECT_GT(norm(state.x[0] - released), 1e-5) << "let go, it moves on its own";
}

TEST(Step, PublishedGetsStifferWithIterationsAndImplicitConverges) {
  // The stretched block is drawn together; K -> infinity makes `published` rigid, `implicit` has a limit that is not.
  const auto length_after = [](Solver solver, int iterations) {
    cutproof::Setup setup = setup_of(fixtures::block(12, 3, 3, 0.01), 1, 0.004);
    setup.step.solver = solver;
    setup.step.substeps = 1;
    setup.step.iterations = iterations;
    setup.step.stiffness = 1e4;
    setup.step.relaxation = 0.5;
    State state = cooked(setup);
    for (Vec3& x : state.x) x.x *= 1.2;
    step(setup, state);
    double low = 1e9, high = -1e9;
    for (const Vec3& x : state.x) {
      low = std::min(low, x.x);
      high = std::max(high, x.x);
    }
    return (high - low) / 0.11;
  };
  EXPECT_LT(length_after(Solver::published, 4), 1.19);
  EXPECT_NEAR(length_after(Solver::published, 20000), 1.0, 1e-6);
  const double limit = length_after(Solver::implicit, 20000);
  EXPECT_GT(limit, 1.01);
  EXPECT_LT(limit, 1.2);
  EXPECT_NEAR(length_after(Solver::implicit, 2000), limit, 1e-9);
}

TEST(Step, DoesNothingToDeadParticles) {
  cutproof::Setup setup = setup_of(fixtures::block(4, 4, 4, 0.01), 1, 0.004);
  setup.step.gravity = {0, 0, -9.81};
  State state = fixtures::foreign_state(setup.body, {{1, 2, 3}}, 1, 10);
  state.alive[0] = 0;
  const Vec3 before = state.x[0];
  step(setup, state);
  EXPECT_EQ(state.x[0], before);
  EXPECT_EQ(state.v[0], Vec3{});
}

TEST(Step, SurvivesABodyOfNoParticles) {
  cutproof::Setup setup = setup_of(fixtures::body_from_nodes({}, 0.01), 1, 0.004);
  State state = cooked(setup);
  step(setup, state);
  EXPECT_TRUE(state.x.empty());
}

TEST(Step, BringsInvertedAndFlattenedBodiesBackWithoutNaN) {
  for (const double factor : {-1.0, 0.0, 1e-9}) {
    cutproof::Setup setup = setup_of(fixtures::block(5, 5, 5, 0.01), 200, 0.004);
    setup.step.stiffness = 1e6;
    setup.step.damping = 5;
    State state = cooked(setup);
    for (Vec3& x : state.x) x.z = 0.03 + factor * (x.z - 0.03);
    for (int frame = 0; frame < 200; ++frame) {
      step(setup, state);
      ++state.frame;
    }
    for (const Vec3& x : state.x) ASSERT_TRUE(is_finite(x)) << factor;
    for (const Mat3& r : state.clusters.rotation) {
      const Vec3 a = {r(0, 0), r(1, 0), r(2, 0)}, b = {r(0, 1), r(1, 1), r(2, 1)}, c = {r(0, 2), r(1, 2), r(2, 2)};
      EXPECT_NEAR(dot(cross(a, b), c), 1, 1e-12) << "a rotation, never a reflection";
    }
  }
}

}  // namespace
}  // namespace cutproof::reference::step_test
