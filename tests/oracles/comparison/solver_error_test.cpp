// The distance to the reference solution of a substep.
#include "oracles/comparison/solver_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "oracles/comparison/reference_solution.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles {
namespace {

using testing::block_body;
using testing::box_clusters;
using testing::setup_of;
using testing::state_of;

constexpr double kH = 0.01;

struct Moving {
  cutproof::Setup setup;
  State state;
};

// A block of 6³ particles, stretched and twisted by its velocities.
Moving twisted_block(int32_t iterations) {
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
    const Moving scene = twisted_block(iterations);
    const auto judged = reference::make_backend(), exact = reference::make_backend();
    const SolverError error = solver_error(*judged, *exact, scene.setup, scene.state).value();
    const ReferenceSolution answer = reference_solution(scene.setup, scene.state);
    const PlainLimit plain = plain_limit(scene.setup, scene.state, 0, iterations);
    double greatest = 0;
    for (std::size_t i = 0; i < plain.x.size(); ++i) greatest = std::max(greatest, norm(plain.x[i] - answer.x[i]) / kH);
    EXPECT_TRUE(error.by_energy);
    EXPECT_TRUE(error.converged);
    EXPECT_EQ(error.position.count, 216);
    EXPECT_NEAR(error.position.max, greatest, 1e-11);
    EXPECT_NEAR(error.energy.value(), plain.energy.back() / answer.energy - 1, 1e-11);
    EXPECT_EQ(iterations == 600, error.position.max < 1e-11) << error.position.max;
    EXPECT_GE(*error.energy, -1e-12);
  }
}

TEST(SolverError, WithoutAnEnergyIsTheDistanceToTheFixedPoint) {
  Moving scene = twisted_block(4);
  const auto judged = reference::make_backend(), exact = reference::make_backend();
  const SolverError by_energy = solver_error(*judged, *exact, scene.setup, scene.state).value();
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = -1, .friction = 0.5}};  // far away
  const SolverError by_iteration = solver_error(*judged, *exact, scene.setup, scene.state).value();
  EXPECT_FALSE(by_iteration.by_energy);
  EXPECT_FALSE(by_iteration.energy);
  EXPECT_TRUE(by_iteration.converged);
  EXPECT_NEAR(by_iteration.position.max, by_energy.position.max, 2 * kFixedPoint);
  EXPECT_NEAR(by_iteration.position.rms(), by_energy.position.rms(), 2 * kFixedPoint);
  scene.setup.step.solver = Solver::published;
  EXPECT_FALSE(solver_error(*judged, *exact, scene.setup, scene.state)) << "stiffer with every iteration";
}

}  // namespace
}  // namespace cutproof::oracles
