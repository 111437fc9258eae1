// The accelerated iteration (docs/design/method.md §11) on every backend: the same answer as the plain one, sooner, and
// everything else that a step must keep.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/backends.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "reference_cpu/reference.h"
#include "tests/gpu/kernels/every_backend.h"
#include "tests/oracles/comparison/twisted_block.h"

namespace cutproof::acceleration_test {
namespace {

using tests::distance;
using tests::EveryBackend;
using tests::obstructed_block;
using tests::Scene;
using tests::twisted_block;

class Accelerated : public EveryBackend {
 protected:
  // The first frame's step with so many iterations.
  State step(cutproof::Setup setup, const State& state, Acceleration acceleration, int32_t iterations) const {
    setup.step.acceleration = acceleration;
    setup.step.iterations = iterations;
    return EveryBackend::step(setup, state);
  }
  // What of an error in double precision is asked for [h], and what rounding leaves in single: as in
  // docs/design/tolerances.md, Against the reference.
  double tolerance(double in_double) const { return EveryBackend::tolerance(in_double, 1e-4); }
};

void expect_holds(const Verdict& verdict) {
  EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  EXPECT_GT(verdict.checked, 0) << verdict.property;
}

TEST_P(Accelerated, ReachesTheConvergedAnswerInAFourthOfTheIterations) {
  for (const double stiffness : {1e4, 1e5, 1e6, 1e8}) {
    Scene scene = twisted_block(12, 3.0, 1.8, 0.01);
    scene.setup.step.stiffness = stiffness;
    const oracles::ReferenceSolution answer = oracles::reference_solution(scene.setup, scene.state);
    ASSERT_TRUE(answer.converged);
    const auto error = [&](Acceleration acceleration, int32_t iterations) {
      return distance(scene.setup, step(scene.setup, scene.state, acceleration, iterations).x, answer.x);
    };
    const double reached = error(Acceleration::chebyshev, 150);
    std::printf("k = %g: %.1e h from the reference solution\n", stiffness, reached);
    EXPECT_LT(reached, tolerance(1e-9)) << stiffness;
    if (stiffness < 1e6) continue;
    // The goal: 1e-2 h, for which the plain iteration needs 61 iterations (1e6) and 100 (1e8).
    EXPECT_LT(error(Acceleration::chebyshev, stiffness == 1e6 ? 15 : 24), 1e-2) << stiffness;
    EXPECT_GT(error(Acceleration::none, stiffness == 1e6 ? 60 : 96), 1e-2) << stiffness;
  }
}

// Flat, inverted, drawn out to a line or to a point (σ2 + σ3 = 0), and each of them disturbed.
TEST_P(Accelerated, ConvergesFromHardStates) {
  for (const Vec3 shape : {Vec3{1, 1, 0}, Vec3{1, 1, -1}, Vec3{1, 1, -0.5}, Vec3{-1, -1, -1}, Vec3{0, 0, 1},
                           Vec3{0, 0, 0}, Vec3{0.2, 0.2, 0.2}}) {
    for (const double stiffness : {1e4, 1e6, 1e8}) {
      Scene scene = twisted_block(6, 0.5, 1.0, 0.01);
      scene.setup.step.stiffness = stiffness;
      for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
        const double phase = 0.37 * static_cast<double>(i);
        const Vec3 d = scene.state.x[i] - Vec3{0.035, 0.035, 0.035};
        const Vec3 noise = {std::sin(phase), std::cos(1.7 * phase), std::sin(phase + 2)};
        scene.state.x[i] = Vec3{shape.x * d.x, shape.y * d.y, shape.z * d.z} + 1e-4 * noise;
      }
      const State settled = step(scene.setup, scene.state, Acceleration::chebyshev, 400);
      const auto energy = [&](const State& state) {
        return oracles::substep_energy(scene.setup, scene.state, state.x);
      };
      // Far from rest there are several minima, and slow ways to them. Accelerated, it is as far down, or farther.
      EXPECT_LT(energy(settled), 1.001 * energy(step(scene.setup, scene.state, Acceleration::none, 400)))
          << shape.x << shape.z << " " << stiffness;
      if (stiffness == 1e4) {
        const oracles::ReferenceSolution answer = oracles::reference_solution(scene.setup, scene.state);
        EXPECT_LT(distance(scene.setup, settled.x, answer.x), tolerance(1e-9)) << shape.x << shape.z;
      }
      expect_holds(oracles::rotation_quality(scene.setup, settled));
    }
  }
}

TEST_P(Accelerated, StaysFiniteForEveryStiffnessAndStep) {
  for (const double dt : {1e-6, 1e-3, 0.1}) {
    for (const double stiffness : {0.0, 1e-12, 1e2, 1e12}) {
      Scene scene = twisted_block(5, 2.0, 1.5, 0.01);
      scene.setup.step.stiffness = stiffness;
      scene.setup.substep_length = {dt};
      for (Vec3& v : scene.state.v) v = (0.004 / dt) * v;  // the same free motion
      for (const int32_t iterations : {2, 3, 50}) {
        const State reached = step(scene.setup, scene.state, Acceleration::chebyshev, iterations);
        EXPECT_TRUE(oracles::finite(scene.setup, reached).holds) << dt << " " << stiffness;
        expect_holds(oracles::rotation_quality(scene.setup, reached));
      }
      if (stiffness > 0) continue;
      EXPECT_EQ(step(scene.setup, scene.state, Acceleration::chebyshev, 7).x,
                step(scene.setup, scene.state, Acceleration::none, 7).x)
          << "without stiffness nothing is pulled";
    }
  }
}

TEST_P(Accelerated, MeetsWallsAndHeldParticlesExactly) {
  for (const double stiffness : {1e4, 1e6}) {
    const Scene scene = obstructed_block(stiffness);
    const oracles::ReferenceSolution answer = oracles::reference_solution(scene.setup, scene.state);
    ASSERT_TRUE(answer.converged);
    const State reached = step(scene.setup, scene.state, Acceleration::chebyshev, 300);
    EXPECT_LT(distance(scene.setup, answer.x, reached.x), tolerance(1e-9)) << stiffness;
  }
}

// Friction and a blade have no energy; the answer is the plain iteration's fixed point.
TEST_P(Accelerated, HasThePlainFixedPointWithFrictionAndABlade) {
  for (const double friction : {0.0, 0.1, 0.4, 5.0}) {
    for (const bool blade : {false, true}) {
      Scene scene = obstructed_block(3e5);
      for (Wall& wall : scene.setup.walls) wall.friction = friction;
      if (blade) {
        scene.setup.has_blade = true;
        scene.setup.blade = {.length = 0.2, .depth = 0.1, .thickness = 0.002, .friction = friction};
        const BladePose from = {{0.035, 0.036, 0.06}, {1, 0, 0}, {0, 0, 1}};
        BladePose to = from;
        to.edge.z -= 0.004;
        scene.setup.blade_moves = {{from, to, true, 0}};
      }
      const State plain = step(scene.setup, scene.state, Acceleration::none, 1500);
      const State reached = step(scene.setup, scene.state, Acceleration::chebyshev, 1500);
      const double apart = distance(scene.setup, plain.x, reached.x);
      std::printf("friction %g, blade %d: %.1e h apart\n", friction, blade, apart);
      // Wedged between blade and wall a particle stays where it is by comparing distances, so to the root of rounding.
      EXPECT_LT(apart, tolerance(blade && friction == 0 ? 1e-7 : 1e-9)) << friction << blade;
    }
  }
}

TEST_P(Accelerated, ConservesMomentumInEveryIteration) {
  for (const double stiffness : {1e3, 1e6, 1e12}) {
    for (const bool obstructed : {false, true}) {
      Scene scene = obstructed ? obstructed_block(stiffness) : twisted_block(6, 2.0, 1.4, 0.01);
      scene.setup.step.stiffness = stiffness;
      scene.setup.step.damping = 2;
      if (obstructed) scene.setup.walls[0].friction = 0.3;
      for (int32_t iterations = 0; iterations <= 24; ++iterations) {
        scene.setup.step.iterations = iterations;
        scene.setup.step.acceleration = Acceleration::chebyshev;
        backend_->load({scene.setup}, {scene.state});
        backend_->run({Stage::step, Stage::step});
        const State after = backend_->snapshot().front();
        expect_holds(oracles::momentum(scene.setup, scene.state, after));
        if (!obstructed && GetParam().name != "reference") {
          EXPECT_EQ(norm(after.impulse), 0) << "nothing touched it";
        }
      }
    }
  }
}

TEST_P(Accelerated, SolvesEverySubstepAnew) {
  Scene scene = obstructed_block(1e6);
  scene.setup.step.substeps = 3;
  scene.setup.step.damping = 1;
  scene.setup.substep_length = {0.002};
  scene.setup.grips[0].active = {1, 1, 0};
  scene.setup.grips[0].displacement.assign(3, {0.0005, 0, 0.001});
  const State plain = step(scene.setup, scene.state, Acceleration::none, 1500);
  const State reached = step(scene.setup, scene.state, Acceleration::chebyshev, 200);
  EXPECT_LT(distance(scene.setup, plain.x, reached.x), tolerance(1e-9));
  const double dt = scene.setup.substep_length[0], h = scene.setup.body.grid.spacing;
  for (std::size_t i = 0; i < plain.v.size(); ++i) {
    EXPECT_LT(norm(plain.v[i] - reached.v[i]) * dt / h, 2 * tolerance(1e-9));
  }
}

TEST_P(Accelerated, BeginsWithThePlainIteration) {
  const Scene scene = obstructed_block(1e6);
  for (const int32_t iterations : {0, 1}) {
    const State plain = step(scene.setup, scene.state, Acceleration::none, iterations);
    const State reached = step(scene.setup, scene.state, Acceleration::chebyshev, iterations);
    EXPECT_EQ(plain.x, reached.x);
    EXPECT_EQ(plain.v, reached.v);
    EXPECT_EQ(plain.impulse, reached.impulse);
  }
  EXPECT_NE(step(scene.setup, scene.state, Acceleration::none, 2).x,
            step(scene.setup, scene.state, Acceleration::chebyshev, 2).x);
}

// Bodies of one load that are solved differently, some touched and some not.
TEST_P(Accelerated, DoesNotMindWhoElseIsLoaded) {
  std::vector<cutproof::Setup> setups;
  std::vector<State> states;
  for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
    for (const int32_t iterations : {1, 4, 9}) {
      for (const bool obstructed : {false, true}) {
        Scene scene = obstructed ? obstructed_block(1e6) : twisted_block(4, 1, 1.2, 0.01);
        scene.setup.step.acceleration = acceleration;
        scene.setup.step.iterations = iterations;
        setups.push_back(scene.setup);
        states.push_back(scene.state);
      }
    }
  }
  backend_->load(setups, states);
  backend_->run({});
  const std::vector<State> together = backend_->snapshot();
  for (std::size_t b = 0; b < setups.size(); ++b) {
    backend_->load({setups[b]}, {states[b]});
    backend_->run({});
    const State alone = backend_->snapshot().front();
    EXPECT_EQ(alone.x, together[b].x) << b;
    EXPECT_EQ(alone.v, together[b].v) << b;
    EXPECT_EQ(alone.impulse, together[b].impulse) << b;
  }
}

// Two blocks on a rough floor, one of them gripped: each the other's stranger.
Scene two_blocks() {
  std::vector<tests::Node> nodes;
  for (int32_t k = 0; k < 5; ++k) {
    for (int32_t j = 0; j < 5; ++j) {
      for (int32_t i = 0; i < 11; ++i) {
        if (i != 5) nodes.push_back({i, j, k});
      }
    }
  }
  Scene scene;
  scene.setup = tests::setup_of(tests::body_of(nodes, 0.01), 3);
  scene.setup.step.stiffness = 1e6;
  scene.setup.step.iterations = 9;
  scene.setup.step.acceleration = Acceleration::chebyshev;
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = 0.0095, .friction = 0.3}};
  scene.state = fixtures::cook(scene.setup.body, {.side = 3}, {}, {}, 1);
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
    Vec3& x = scene.state.x[i];
    scene.state.v[i] = {-3 * x.y, 3 * x.x, -0.3};
    x.z *= 1.1;
  }
  return scene;
}

TEST_P(Accelerated, KeepsWhatEveryStepMust) {
  Scene scene = two_blocks();
  const Verdict apart = oracles::no_ghost_force(*backend_, scene.setup, scene.state, 0, {0.03, -0.02, 0.01}, 3);
  expect_holds(apart);
  EXPECT_EQ(apart.checked, 125) << "every particle of the other block, to the bit";
  expect_holds(oracles::determinism(*backend_, scene.setup, scene.state, 3));
  expect_holds(oracles::span_composition(*backend_, scene.setup, scene.state, 2));
  for (const int32_t iterations : {2, 9, 100}) {
    scene.setup.step.iterations = iterations;
    expect_holds(oracles::rest_is_fixed(*backend_, scene.setup, scene.state));
    expect_holds(oracles::translation_is_exact(*backend_, scene.setup, scene.state, {3, -1, 2}));
  }
  scene.setup.step.iterations = 9;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const Verdict verdict =
        oracles::equivariance(*backend_, scene.setup, scene.state, {Stage::step, Stage::step}, seed);
    EXPECT_TRUE(verdict.holds) << "seed " << seed << ": " << verdict.witness.text;
  }
  scene.setup.walls[0].friction = 0;
  const Verdict energy = oracles::energy_is_monotone(*backend_, scene.setup, scene.state, 9);
  expect_holds(energy);
  EXPECT_EQ(energy.checked, 1) << "only the first iteration is promised";
}

INSTANTIATE_TEST_SUITE_P(Over, Accelerated, ::testing::ValuesIn(tests::all_backends()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace cutproof::acceleration_test
