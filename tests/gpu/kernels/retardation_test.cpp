// Kelvin and Voigt's material (docs/design/method.md §3) on every backend: what follows from its equation by hand, and
// the answer of a substep.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "oracles/comparison/reference_solution.h"
#include "oracles/oracles.h"
#include "tests/gpu/kernels/every_backend.h"
#include "tests/oracles/comparison/twisted_block.h"

namespace cutproof::retardation_test {
namespace {

using tests::distance;
using tests::EveryBackend;
using tests::obstructed_block;
using tests::pressed_block;
using tests::Scene;
using tests::twisted_block;

class Retardation : public EveryBackend {};

// A block in one cluster, drawn out along x and let go: each particle swings about where it belongs, with
// δ'' = −k (δ + τ δ'), and nothing turns.
class Drawn {
 public:
  Drawn(double stiffness, double retardation, double dt, int64_t frames)
      : scene{tests::setup_of(tests::block_body(4, 4, 4, kSpacing)), {}} {
    scene.setup.step.substeps = 1;
    scene.setup.step.iterations = 2;
    scene.setup.step.stiffness = stiffness;
    scene.setup.step.retardation = retardation;
    scene.setup.substep_length.assign(static_cast<std::size_t>(frames), dt);
    scene.state = tests::state_of(scene.setup.body, tests::box_clusters(4, 4, 4, 4));
    const double middle = 2.5 * kSpacing;
    for (Vec3& x : scene.state.x) x.x = middle + (1 + kDrawn) * (x.x - middle);
  }
  // How far the last particle is off, of how far it was drawn.
  double left(const State& state) const {
    const Vec3 rest = scene.setup.body.rest_position(scene.setup.body.particle_count() - 1);
    return (state.x.back().x - rest.x) / (kDrawn * 1.5 * kSpacing);
  }

  static constexpr double kSpacing = 0.01, kDrawn = 0.2;
  Scene scene;
};

// δ at time t of 1 at rest.
double swing(double stiffness, double retardation, double t) {
  const double rate = stiffness * retardation / 2, square = stiffness - rate * rate;
  const double w = std::sqrt(std::abs(square));
  return square > 0 ? std::exp(-rate * t) * (std::cos(w * t) + rate / w * std::sin(w * t))
                    : std::exp(-rate * t) * (std::cosh(w * t) + rate / w * std::sinh(w * t));
}

// Beside the equation step by step, and beside its solution, from which each halving of dt takes half of the distance.
TEST_P(Retardation, IsADampedSpring) {
  int halvings = 0;
  for (const auto& [stiffness, retardation] :
       {std::pair{1e4, 0.0}, {1e4, 0.001}, {1e4, 0.01}, {1e4, 0.03}, {1e2, 0.05}}) {
    double before = 0;
    for (const int64_t substeps : {16, 32, 64}) {
      const double time = 0.03, dt = time / static_cast<double>(substeps);
      const Drawn drawn(stiffness, retardation, dt, substeps);
      State now = drawn.scene.state;
      double off = 0, x = 1, v = 0;
      for (int64_t s = 0; s < substeps; ++s) {
        now = step(drawn.scene.setup, now);
        ++now.frame;
        // v' = v − k dt (x' + τ v'), x' = x + dt v'.
        v = (v - stiffness * dt * x) / (1 + stiffness * dt * (dt + retardation));
        x += dt * v;
        off = std::max(off, std::abs(drawn.left(now) - x));
      }
      // What a substep rounds, u of what is stored of a place, a velocity has 1 / dt times as much, and carries it on.
      // In double places are stored, 20 times what it was drawn by; in single displacements.
      const auto count = static_cast<double>(substeps);
      const double rounding = count * count * tolerance(20 * 0x1p-53, 0x1p-24);
      EXPECT_LT(off, rounding) << stiffness << " " << retardation << " " << substeps;
      const double error = std::abs(drawn.left(now) - swing(stiffness, retardation, time));
      std::printf("k = %g, tau = %g, %3ld substeps: %.2e off the spring\n", stiffness, retardation,
                  static_cast<long>(substeps), error);
      if (substeps > 16 && error > 10 * rounding) {
        EXPECT_GT(before / error, 1.6) << stiffness << " " << retardation << " " << substeps;
        ++halvings;
      }
      before = error;
    }
  }
  EXPECT_GE(halvings, 8) << "rounding hides the rest of ten";
}

// It slows down what changes shape and not what moves as a whole.
TEST_P(Retardation, LeavesMotionAsAWhole) {
  Scene scene = twisted_block(6, 0, 1, 0.01);
  scene.setup.step.retardation = 0.05;
  scene.setup.substep_length.assign(8, 0.004);
  scene.state.v.assign(scene.state.v.size(), {1, -2, 3});
  State now = scene.state;
  for (int frame = 0; frame < 8; ++frame) {
    now = step(scene.setup, now);
    ++now.frame;
  }
  for (std::size_t i = 0; i < now.x.size(); ++i) {
    EXPECT_LT(norm(now.x[i] - scene.state.x[i] - 0.032 * Vec3{1, -2, 3}), 0.01 * tolerance(1e-12, 1e-5));
    EXPECT_LT(norm(now.v[i] - Vec3{1, -2, 3}), tolerance(1e-12, 1e-5));
  }
}

// Of what turns, y lies ahead on the tangent, by an angle of ω (dt + τ), and the force along y that holds it on its
// circle, ω² r, has so much of itself against the turn: dω/dt = −ω³ (dt + τ), as of substeps of dt + τ.
TEST_P(Retardation, SlowsATurnAsALongerStepDoes) {
  const double dt = 0.001, spin = 5;
  const int substeps = 100;
  const auto spin_left = [&](double retardation) {
    Scene scene = twisted_block(5, 0, 1, 0.01);
    scene.setup.step.retardation = retardation;
    scene.setup.step.iterations = 20;
    scene.setup.substep_length.assign(substeps, dt);
    const auto spin_of = [&](const State& state) {
      double sum = 0;
      for (std::size_t i = 0; i < state.x.size(); ++i) {
        sum += (state.x[i].x - 0.03) * state.v[i].y - (state.x[i].y - 0.03) * state.v[i].x;
      }
      return sum;
    };
    for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
      const Vec3 x = scene.state.x[i];
      scene.state.v[i] = spin * Vec3{-(x.y - 0.03), x.x - 0.03, 0};
    }
    State now = scene.state;
    for (int frame = 0; frame < substeps; ++frame) {
      now = step(scene.setup, now);
      ++now.frame;
    }
    return spin_of(now) / spin_of(scene.state);
  };
  for (const double retardation : {0.0, 0.001, 0.004}) {
    const double left = spin_left(retardation);
    const double expected = 1 / std::sqrt(1 + 2 * spin * spin * (dt + retardation) * substeps * dt);
    std::printf("tau = %g: of its spin are left %.5f, expected %.5f\n", retardation, left, expected);
    EXPECT_NEAR(1 - left, 1 - expected, 0.03 * (1 - expected)) << "to first order in the angle of a substep";
  }
}

TEST_P(Retardation, HeldParticlesAreWhereTheirGripPutsThem) {
  for (const double retardation : {0.0004, 0.004, 0.1}) {
    Scene scene = obstructed_block(1e5);
    scene.setup.step.retardation = retardation;
    scene.setup.step.substeps = 2;
    scene.setup.grips[0].active = {1, 1};
    scene.setup.grips[0].displacement.assign(2, {0.001, 0, 0.002});
    const State now = step(scene.setup, scene.state);
    for (const int32_t i : scene.setup.grips[0].particles) {
      const auto k = static_cast<std::size_t>(i);
      EXPECT_LT(norm(now.x[k] - scene.state.x[k] - 2.0 * Vec3{0.001, 0, 0.002}), 0.01 * tolerance(1e-13, 1e-7));
    }
  }
}

// Accelerated, with walls, a grip, a blade and friction: the answer that owes nothing to any iteration.
TEST_P(Retardation, ComesToTheAnswerOfItsSubstep) {
  for (const double retardation : {0.001, 0.004, 0.02}) {
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      for (const Scene& given :
           {twisted_block(12, 1.0, 1.3, 0.01), obstructed_block(1e5), pressed_block(1e5, 0), pressed_block(1e5, 0.3)}) {
        Scene scene = given;
        scene.setup.step.retardation = retardation;
        scene.setup.step.acceleration = acceleration;
        scene.setup.step.iterations = 800;
        const oracles::SubstepAnswer answer = oracles::substep_answer(scene.setup, scene.state);
        ASSERT_TRUE(answer.converged);
        EXPECT_NE(answer.by, oracles::SolvedBy::iteration);
        const State now = step(scene.setup, scene.state);
        EXPECT_LT(distance(scene.setup, now.x, answer.x), tolerance(1e-9, 1e-4)) << retardation;
        const Verdict momentum = oracles::momentum(scene.setup, scene.state, now);
        EXPECT_TRUE(momentum.holds) << momentum.witness.text;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Over, Retardation, ::testing::ValuesIn(tests::all_backends()),
                         [](const auto& named) { return named.param.name; });

}  // namespace
}  // namespace cutproof::retardation_test
