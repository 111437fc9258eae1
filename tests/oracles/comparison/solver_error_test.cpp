// The distance to the reference solution of a substep.
#include "oracles/comparison/solver_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "oracles/comparison/reference_solution.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/comparison/twisted_block.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::solver_error_test {
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

// A block of 6³ particles, stretched and twisted by its velocities.
Moving twisting_block(int32_t iterations) {
  Moving scene{setup_of(block_body(6, 6, 6, kH)), {}};
  scene.setup.step.iterations = iterations;
  scene.state = state_of(scene.setup.body, box_clusters(6, 6, 6, 3));
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
    const Vec3 d = scene.state.x[i] - Vec3{3.5 * kH, 3.5 * kH, 3.5 * kH};
    scene.state.v[i] = {-100 * d.z * d.y / kH, 100 * d.z * d.x / kH, 60 * d.z};
  }
  return scene;
}

TEST(SolverError, IsThatOfThePlainIterationAsItIsWrittenDownElsewhere) {
  for (const int32_t iterations : {1, 4, 600}) {
    const Moving scene = twisting_block(iterations);
    const auto judged = reference::make_backend();
    const SolverError error = solver_error(*judged, scene.setup, scene.state).value();
    const ReferenceSolution answer = reference_solution(scene.setup, scene.state);
    const PlainLimit plain = plain_limit(scene.setup, scene.state, 0, iterations);
    double greatest = 0;
    for (std::size_t i = 0; i < plain.x.size(); ++i) greatest = std::max(greatest, norm(plain.x[i] - answer.x[i]) / kH);
    EXPECT_EQ(error.solved_by, SolvedBy::minimum);
    EXPECT_TRUE(error.converged);
    EXPECT_EQ(error.position.count, 216);
    EXPECT_NEAR(error.position.max, greatest, 1e-11);
    EXPECT_NEAR(error.energy.value(), plain.energy.back() / answer.energy - 1, 1e-11);
    EXPECT_EQ(iterations == 600, error.position.max < 1e-11) << error.position.max;
    EXPECT_GE(*error.energy, -1e-12);
  }
}

TEST(SolverError, IsTheSameBesideContactsThatAreNeverTouched) {
  Moving scene = twisting_block(4);
  const auto judged = reference::make_backend();
  const SolverError without = solver_error(*judged, scene.setup, scene.state).value();
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = -1, .friction = 0.5}};  // far away
  const SolverError beside = solver_error(*judged, scene.setup, scene.state).value();
  EXPECT_EQ(beside.solved_by, SolvedBy::rest);
  EXPECT_FALSE(beside.energy);
  EXPECT_TRUE(beside.converged);
  EXPECT_NEAR(beside.position.max, without.position.max, 1e-11);
  EXPECT_NEAR(beside.position.rms(), without.position.rms(), 1e-11);
  scene.setup.step.solver = Solver::published;
  EXPECT_FALSE(solver_error(*judged, scene.setup, scene.state)) << "stiffer with every iteration";
}

TEST(SolverError, UnderABladeIsTheDistanceToAnAnswerOfItsOwn) {
  for (const double friction : {0.0, 0.3}) {
    tests::Scene scene = tests::pressed_block(1e5, friction);
    for (const int32_t iterations : {4, 1500}) {
      scene.setup.step.iterations = iterations;
      const auto judged = reference::make_backend();
      const SolverError error = solver_error(*judged, scene.setup, scene.state).value();
      EXPECT_EQ(error.solved_by, friction == 0 ? SolvedBy::minimum : SolvedBy::rest);
      EXPECT_TRUE(error.converged);
      EXPECT_FALSE(error.elsewhere);
      EXPECT_EQ(error.energy.has_value(), friction == 0);
      EXPECT_EQ(iterations == 1500, error.position.max < 1e-10) << error.position.max;
      EXPECT_GE(error.energy.value_or(0), -1e-12);
    }
  }
}

}  // namespace
}  // namespace cutproof::oracles::solver_error_test
