// `cutproof bench factors`: every way of having the factor after a cut solves the changed system to its derived bound.
// What the times are is not tested.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "benchmarks/cut_cube.h"
#include "benchmarks/factorise.h"
#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "reference_cpu/reference.h"
#include "tests/cli/program.h"

namespace {

using cutproof::Body;
using cutproof::State;
using cutproof::benchmarks::change_of;
using cutproof::benchmarks::Cut;
using cutproof::benchmarks::factorise;
using cutproof::benchmarks::kWays;
using cutproof::benchmarks::name_of;
using cutproof::benchmarks::ReadyScene;
using cutproof::benchmarks::residual_bound;
using cutproof::benchmarks::SystemChange;
using cutproof::benchmarks::Way;
using cutproof::oracles::ClusterSystem;
using nlohmann::json;

constexpr double kS = 16.0 / 17;  // k = 1e6 s⁻², dt = 4 ms

std::vector<double> right_of(const SystemChange& change, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<double> right(change.origin.size());
  for (double& value : right) value = std::uniform_real_distribution<double>(-1, 1)(random);
  return right;
}

// B x, entry by entry from its definition in oracles/comparison/cluster_system.h.
std::vector<std::vector<double>> dense(const ClusterSystem& system) {
  const std::size_t n = system.mass.size();
  std::vector<std::vector<double>> matrix(n, std::vector<double>(n, 0.0));
  for (std::size_t r = 0; r < n; ++r) matrix[r][r] = system.mass[r];
  for (const auto& [clusters, weight] : system.shared) {
    for (const int32_t a : clusters) {
      for (const int32_t b : clusters) matrix[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] -= weight;
    }
  }
  return matrix;
}

// ‖right − B x‖ / (‖B‖ ‖x‖)
double residual(const ClusterSystem& system, const std::vector<double>& right, const std::vector<double>& x) {
  const auto matrix = dense(system);
  double norm = 0, largest = 0, rest = 0;
  for (std::size_t r = 0; r < x.size(); ++r) {
    double sum = 0, product = 0;
    for (std::size_t c = 0; c < x.size(); ++c) {
      sum += std::abs(matrix[r][c]);
      product += matrix[r][c] * x[c];
    }
    norm = std::max(norm, sum);
    largest = std::max(largest, std::abs(x[r]));
    rest = std::max(rest, std::abs(right[r] - product));
  }
  return rest / (norm * largest);
}

TEST(ClusterSystem, IsWhatTheClustersSay) {
  // Three particles in a row of mass 1; clusters {0, 1} and {1, 2}.
  const Body body = cutproof::fixtures::block(3, 1, 1, 1.0, 1.0);
  const State state = cutproof::fixtures::foreign_state(body, {{0, 1}, {1, 2}}, 0, 10);
  const auto free = cutproof::oracles::cluster_system(body, state.clusters, 0.5, {0, 0, 0});
  EXPECT_EQ(dense(free), (std::vector<std::vector<double>>{{1.5 - 0.5 - 0.125, -0.125}, {-0.125, 1.5 - 0.5 - 0.125}}));
  const auto held = cutproof::oracles::cluster_system(body, state.clusters, 0.5, {0, 1, 0});
  EXPECT_EQ(dense(held), (std::vector<std::vector<double>>{{1, 0}, {0, 1}}));
}

TEST(Factors, EveryWaySolvesTheSystemAfterEveryCut) {
  for (const auto& [side, core] : {std::pair{12, 3}, std::pair{9, 2}, std::pair{10, 5}}) {
    const ReadyScene cube = cutproof::benchmarks::make_cut_cube(side, core);
    std::set<Way> ran;
    for (const Cut& cut : cuts_of(cube)) {
      ASSERT_NE(cut.before.alive, cut.after.alive) << cut.name;
      const SystemChange change = change_of(cube.setup.body, cut.before, cut.after, kS);
      ASSERT_FALSE(change.changed.empty());
      const std::vector<double> right = right_of(change, 7);
      std::vector<double> first;
      for (const Way way : kWays) {
        const auto factorised = factorise(change, way, right);
        if (!factorised) {
          EXPECT_EQ(way, Way::numeric);
          continue;
        }
        ran.insert(way);
        const double found = residual(change.after, right, factorised->x), bound = residual_bound(change, way);
        SCOPED_TRACE(cube.name + ", " + cut.name + ", " + name_of(way));
        EXPECT_LE(found, bound);
        EXPECT_NEAR(factorised->residual, found, 1e-14);
        EXPECT_LT(bound, 1e-6);
        // What the system before gives is no answer: the bound tells them apart.
        EXPECT_GT(residual(change.before, right, factorised->x), 10 * bound);
        if (way == Way::analyse) first = factorised->x;
        for (std::size_t r = 0; r < first.size(); ++r) {
          // ‖B⁻¹‖ ≤ 1 / ((1 − s) min M), because B is diagonally dominant by that much in every row.
          const double least = *std::min_element(change.after.mass.begin(), change.after.mass.end());
          double norm = 0, largest = 0;
          for (const auto& row : dense(change.after)) {
            double sum = 0;
            for (const double entry : row) sum += std::abs(entry);
            norm = std::max(norm, sum);
          }
          for (const double value : first) largest = std::max(largest, std::abs(value));
          ASSERT_NEAR(factorised->x[r], first[r],
                      (bound + residual_bound(change, Way::analyse)) * norm / ((1 - kS) * least) * largest);
        }
      }
    }
    EXPECT_GE(ran.size(), 4U) << cube.name;
  }
}

TEST(Factors, ACutThatOnlyTakesParticlesKeepsThePattern) {
  // Particle 0 leaves a cluster that stays in one piece.
  const Body body = cutproof::fixtures::block(6, 6, 6, 0.01);
  const cutproof::ClusterSpec spec{.side = 3};
  const State before = cutproof::fixtures::cook(body, spec, {}, {}, 1);
  State after = before;
  cutproof::Setup setup;
  setup.body = body;
  after.alive[0] = 0;
  after.removed = {0};
  cutproof::reference::split(setup, after);
  const SystemChange change = change_of(body, before, after, kS);
  EXPECT_EQ(change.new_rows, 0);
  EXPECT_EQ(change.changed, std::vector<int32_t>{0});
  const std::vector<double> right = right_of(change, 3);
  for (const Way way : kWays) {
    const auto factorised = factorise(change, way, right);
    ASSERT_TRUE(factorised.has_value()) << name_of(way);
    EXPECT_LE(residual(change.after, right, factorised->x), residual_bound(change, way)) << name_of(way);
  }
}

TEST(Factors, RowsFollowTheirClusters) {
  const Body body = cutproof::fixtures::block(8, 1, 1, 1.0);
  const State before = cutproof::fixtures::foreign_state(body, {{0, 1, 2, 3}, {3, 4, 5, 6, 7}}, 0, 10);
  // Cluster 1 loses particle 5 and falls apart; its larger piece is listed last.
  State after = cutproof::fixtures::foreign_state(body, {{0, 1, 2, 3}, {6}, {3, 4, 7}}, 0, 10);
  const SystemChange change = change_of(body, before, after, kS);
  EXPECT_EQ(change.new_rows, 1);
  EXPECT_EQ(change.origin, (std::vector<int32_t>{0, 1, 1}));
  EXPECT_EQ(change.changed, (std::vector<int32_t>{1, 2}));
  EXPECT_DOUBLE_EQ(change.after.mass[1], 1000 * 2.5);
  EXPECT_DOUBLE_EQ(change.after.mass[2], 1000);
  // A merge leaves a row without a cluster: it has a mass, and nothing is shared with it.
  const State merged = cutproof::fixtures::foreign_state(body, {{0, 1, 2, 3, 4, 5, 6, 7}}, 0, 10);
  const SystemChange merge = change_of(body, before, merged, kS);
  EXPECT_EQ(merge.new_rows, 0);
  EXPECT_EQ(merge.after.shared.size(), 1U);
  const std::vector<double> right = right_of(merge, 5);
  for (const Way way : kWays) {
    const auto factorised = factorise(merge, way, right);
    ASSERT_TRUE(factorised.has_value());
    EXPECT_LE(residual(merge.after, right, factorised->x), residual_bound(merge, way)) << name_of(way);
  }
}

class FactorsBench : public Program {};

TEST_F(FactorsBench, TellsEveryTimeWithItsResidual) {
  const Outcome outcome = cutproof("bench factors --sides 12 --fine-sides 8 --repeats 2 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("suite"), "factors");
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  ASSERT_EQ(document.at("scenes").size(), 2U);
  for (const json& scene : document.at("scenes")) {
    EXPECT_EQ(scene.at("converged_substep").at("converged"), true);
    std::set<std::string> cuts, ways;
    for (const json& row : scene.at("rows")) {
      cuts.insert(row.at("cut"));
      ways.insert(row.at("way"));
      EXPECT_GT(row.at("seconds").at("median"), 0) << row;
      EXPECT_GT(row.at("removed"), 0) << row;
      EXPECT_LE(row.at("residual"), row.at("residual_bound")) << row;
    }
    EXPECT_EQ(cuts.size(), 3U);
    EXPECT_TRUE(ways.contains("analyse") && ways.contains("ordered") && ways.contains("updown") &&
                ways.contains("rows"));
  }
}

TEST_F(FactorsBench, RefusesBadUsage) {
  expect_refused("bench factors --sides 3", {"--sides"});
  expect_refused("bench factors --fine-sides 1000", {"--fine-sides"});
  expect_refused("bench factors --repeats 0", {"--repeats"});
  expect_refused("bench factors --json no/such/folder/f.json", {"no/such/folder"});
}

}  // namespace
