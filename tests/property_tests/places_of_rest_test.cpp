// Where substeps of random cases come to rest, by the solver without iteration and by plain iterations: in contacts
// that nobody has thought of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/at.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/comparison/solver_error.h"
#include "oracles/single_substep.h"
#include "property_tests/cases.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests::places_of_rest_test {
namespace {

bool has_friction(const Setup& setup) {
  const bool blade = setup.has_blade && setup.blade_moves[0].down && setup.detect.criterion != Criterion::geometric;
  return (blade && setup.blade.friction > 0) ||
         std::any_of(setup.walls.begin(), setup.walls.end(), [](const Wall& wall) { return wall.friction > 0; });
}

TEST(PlacesOfRest, AreThoseOfPlainIterations) {
  constexpr uint64_t kSeed = 20261127;
  constexpr int kSize = 40, kFrames = 3;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  struct Count {
    int frames = 0, met = 0, minima = 0;
  } with_friction, without;
  for (uint64_t seed = kSeed; seed < kSeed + 250; ++seed) {
    const Instance instance = instance_of(draw_moving_case(seed, kSize));
    if (instance.setup.step.solver != Solver::implicit || instance.state.clusters.count() == 0) continue;
    const auto backend = reference::make_backend();
    backend->load({instance.setup}, {instance.state});
    for (int64_t frame = 0; frame < std::min<int64_t>(instance.setup.frame_count(), kFrames); ++frame) {
      State state = backend->snapshot().front();
      const cutproof::Setup one = oracles::single_substep_setup(instance.setup, state.frame);
      state.frame = 0;
      const oracles::ReferenceSolution rest = oracles::reference_solution(one, state);
      const oracles::PlainLimit limit = oracles::plain_limit(one, state, 1e-13, 6000);
      double apart = 0;
      for (std::size_t i = 0; i < rest.x.size(); ++i) apart = std::max(apart, norm(rest.x[i] - limit.x[i]));
      apart /= one.body.grid.spacing;
      Count& count = has_friction(one) ? with_friction : without;
      ++count.frames;
      const bool met = rest.converged && apart <= oracles::kMeets;
      count.met += met;
      count.minima += rest.is_minimum;
      if (!met) {
        std::printf("seed %llu, frame %lld: %g h apart, converged %d, minimum %d\n",
                    static_cast<unsigned long long>(seed), static_cast<long long>(frame), apart, rest.converged,
                    rest.is_minimum);
      }
      // What is no minimum of E can only be that with friction, or between blade and walls.
      EXPECT_FALSE(has_friction(one) && rest.is_minimum) << seed;
      backend->run(Span{});
    }
  }
  std::printf("frames with friction %d, met %d; without %d, met %d, minima %d\n", with_friction.frames,
              with_friction.met, without.frames, without.met, without.minima);
  EXPECT_GT(with_friction.frames, 200);
  EXPECT_GT(without.frames, 80);
  EXPECT_GE(with_friction.met, 0.98 * with_friction.frames);
  EXPECT_GE(without.met, 0.95 * without.frames);
  EXPECT_GE(without.minima, 0.9 * without.frames);
}

// A body of five particles that the blade has turned by much: plain iterations end in one minimum, Newton's method in
// another one, which is deeper. Neither is passed off as the other.
TEST(PlacesOfRest, AnotherOneIsSaidToBeAnotherOne) {
  Case drawn = draw_moving_case(32, 40);
  // Found so: with the retardation and the clusters that are drawn, both ways end in one place.
  drawn.retardation = 0;
  drawn.clusters = ClusterKind::foreign;
  const Instance instance = instance_of(drawn);
  const auto judged = reference::make_backend();
  const oracles::SolverError error = oracles::solver_error(*judged, instance.setup, instance.state).value();
  EXPECT_EQ(error.solved_by, oracles::SolvedBy::iteration);
  EXPECT_TRUE(error.converged);
  ASSERT_TRUE(error.elsewhere);
  EXPECT_GT(error.elsewhere->distance, 0.1);
  EXPECT_LT(error.elsewhere->energy, -0.01);
  EXPECT_FALSE(error.energy);
}

}  // namespace
}  // namespace cutproof::property_tests::places_of_rest_test
