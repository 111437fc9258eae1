// `cutproof bench solver`: every time beside its error, and the errors are those of the iterations. What the times are
// is not tested.
#include "benchmarks/solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "oracles/comparison/reference_solution.h"
#include "reference_cpu/reference.h"
#include "tests/program.h"

namespace solver_test {
namespace {

using cutproof::Acceleration;
using cutproof::Backend;
using cutproof::Setup;
using cutproof::Span;
using cutproof::SpanReport;
using cutproof::State;
using cutproof::benchmarks::ReadyScene;
using cutproof::benchmarks::SolverError;
using nlohmann::json;

class SolverBench : public Program {};

TEST_F(SolverBench, TellsEveryTimeWithItsErrorAndWhatTheToleranceCosts) {
  const Outcome outcome = cutproof(
      "bench solver --backend host --stiffness 1e5,1e6 --substeps 1,2 --iterations 1,4,64 --particles 512 --samples 1 "
      "--json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("suite"), "solver");
  EXPECT_EQ(document.at("precision"), "single");
  EXPECT_EQ(document.at("complete"), true);
  ASSERT_EQ(document.at("scenes").size(), 2U * 2U * 2U);
  for (const json& scene : document.at("scenes")) {
    EXPECT_TRUE(scene.at("converged"));
    std::map<std::string, std::map<int, double>> errors;
    for (const json& row : scene.at("rows")) {
      errors[row.at("acceleration")][row.at("iterations")] = row.at("max_h");
      EXPECT_LE(row.at("rms_h"), row.at("max_h")) << row;
      EXPECT_GT(row.at("seconds").at("median"), 0) << row;
      EXPECT_EQ(row.at("energy_gap").is_null(), scene.at("substeps") != 1) << row;
    }
    for (const char* acceleration : {"none", "chebyshev"}) {
      for (const int iterations : {1, 4, 64}) ASSERT_TRUE(errors[acceleration].contains(iterations)) << iterations;
      EXPECT_GT(errors[acceleration][1], errors[acceleration][4]);
      EXPECT_LT(errors[acceleration][64], 1e-2);
    }
    EXPECT_EQ(errors["none"][1], errors["chebyshev"][1]) << "the first iteration is plain";
    ASSERT_EQ(scene.at("to_tolerance").size(), 2U);
    for (const json& found : scene.at("to_tolerance")) {
      const int iterations = found.at("iterations");
      EXPECT_LT(errors[found.at("acceleration")].at(iterations), 1e-2);
    }
    // The goal of the acceleration: at most half of the iterations.
    if (scene.at("scene") == "block" && scene.at("substeps") == 1 && scene.at("stiffness") == 1e6) {
      EXPECT_EQ(scene.at("particles"), 1728);
      EXPECT_EQ(scene.at("clusters"), 27);
      EXPECT_LE(2 * scene.at("to_tolerance").at(1).at("iterations").get<int>(),
                scene.at("to_tolerance").at(0).at("iterations").get<int>());
    }
  }
}

TEST_F(SolverBench, RefusesBadUsage) {
  expect_refused("bench solver --backend nobody", {"nobody"});
  expect_refused("bench solver --backend simulated", {"simulated", "timing"});
  expect_refused("bench solver --stiffness 0", {"--stiffness"});
  expect_refused("bench solver --substeps 0", {"--substeps"});
  expect_refused("bench solver --iterations 4,2", {"--iterations", "order"});
  expect_refused("bench solver --iterations 0", {"--iterations"});
  expect_refused("bench solver --particles 5", {"--particles"});
  expect_refused("bench solver --tolerance -1", {"--tolerance"});
  expect_refused("bench solver --json no/such/folder/f.json", {"no/such/folder"});
}

TEST(SolverErrors, VanishAtTheAnswerOfEverySubstep) {
  const ReadyScene scene = cutproof::benchmarks::make_block_scene();
  const auto backend = cutproof::reference::make_backend();
  for (const int32_t substeps : {1, 3}) {
    cutproof::Setup setup = cutproof::benchmarks::with_substeps(scene, substeps);
    EXPECT_DOUBLE_EQ(setup.substep_length.at(0) * substeps, scene.setup.substep_length.at(0));
    setup.step.stiffness = 1e5;
    setup.step.iterations = 200;
    const auto solution = cutproof::benchmarks::converged_frame(setup, scene.state);
    EXPECT_TRUE(solution.converged);
    const SolverError error = cutproof::benchmarks::solver_error(*backend, setup, scene.state, solution);
    EXPECT_LT(error.position.max, 1e-10);
    EXPECT_EQ(error.energy_gap.has_value(), substeps == 1);
    if (error.energy_gap) {
      EXPECT_LT(std::abs(*error.energy_gap), 1e-12);
    }
  }
}

TEST(SolverErrors, FindTheLeastIterationsThatAreEnough) {
  const ReadyScene scene = cutproof::benchmarks::make_block_scene();
  const auto backend = cutproof::reference::make_backend();
  cutproof::Setup setup = scene.setup;
  setup.step.stiffness = 1e5;
  const auto solution = cutproof::benchmarks::converged_frame(setup, scene.state);
  const auto least = cutproof::benchmarks::least_iterations(*backend, setup, scene.state, solution, 1e-2, 0, 32);
  ASSERT_TRUE(least.has_value());
  const auto error = [&](int32_t iterations) {
    setup.step.iterations = iterations;
    return cutproof::benchmarks::solver_error(*backend, setup, scene.state, solution).position.max;
  };
  EXPECT_LT(error(*least), 1e-2);
  EXPECT_GE(error(*least - 1), 1e-2);
  EXPECT_FALSE(
      cutproof::benchmarks::least_iterations(*backend, setup, scene.state, solution, 1e-2, 0, *least - 1).has_value());
}

// A backend whose step puts one particle somewhere.
class Misplacing final : public Backend {
 public:
  explicit Misplacing(cutproof::Vec3 to) : to_(to) {}
  std::string name() const override { return "misplacing"; }
  bool can_run(Span) const override { return true; }
  void load(std::vector<Setup>, std::vector<State> states) override { states_ = std::move(states); }
  void run(Span) override { states_.front().x[7] = to_; }
  std::vector<State> snapshot() const override { return states_; }
  SpanReport report() const override { return {}; }

 private:
  cutproof::Vec3 to_;
  std::vector<State> states_;
};

TEST(SolverErrors, SeeOneParticleOutOfPlace) {
  const ReadyScene scene = cutproof::benchmarks::make_block_scene();
  cutproof::benchmarks::FrameSolution solution;
  solution.x = scene.state.x;
  const double h = scene.setup.body.grid.spacing;
  Misplacing off(scene.state.x[7] + cutproof::Vec3{0, 0.5 * h, 0});
  const SolverError error = cutproof::benchmarks::solver_error(off, scene.setup, scene.state, solution);
  EXPECT_NEAR(error.position.max, 0.5, 1e-12);
  EXPECT_NEAR(error.position.rms(), 0.5 / std::sqrt(1728.0), 1e-12);
  Misplacing lost({std::numeric_limits<double>::quiet_NaN(), 0, 0});
  EXPECT_TRUE(std::isinf(cutproof::benchmarks::solver_error(lost, scene.setup, scene.state, solution).position.max));
}

}  // namespace
}  // namespace solver_test
