// The strain criterion on blocks that are bent. Under an affine motion every weighting of a cluster's particles finds
// the same deformation gradient, so only where the motion is not affine does it show which one is used: w = m / n
// (method.md §2). Oracle, reference and kernels each do it in their own way; here a fourth.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <tuple>
#include <vector>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/backends.h"
#include "model/at.h"
#include "oracles/oracles.h"
#include "property_tests/cases.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests::bent_strain_test {
namespace {

struct BentBlock {
  cutproof::Setup setup;
  State state;
};

// A block of some size, of particles of different mass, in overlapping clusters, bent by a quadratic field and turned.
BentBlock bent_block(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto whole = [&](int32_t low, int32_t high) { return std::uniform_int_distribution(low, high)(random); };
  BentBlock made;
  Setup& setup = made.setup;
  setup.body = fixtures::block(whole(4, 9), whole(3, 6), whole(2, 5), 0.01);
  for (double& m : setup.body.mass) m *= uniform(0.5, 2);
  setup.step.substeps = 1;
  setup.step.iterations = 0;
  setup.substep_length = {1e-3};
  setup.detect.criterion = Criterion::strain;
  setup.detect.without_blade = true;
  ClusterSpec spec;
  spec.method = whole(0, 1) == 0 ? Cooking::boxes : Cooking::sampled;
  spec.side = whole(2, 3);
  spec.spacing = 1.5;
  spec.radius = uniform(1.5, 3);
  made.state = fixtures::cook(setup.body, spec, {}, {}, random());
  const double length = 0.01 * setup.body.grid.nodes[0], bend = uniform(0.1, 0.6) / length;
  const double stretch = uniform(0.9, 1.3) - 1, angle = uniform(0, 3);
  const Vec3 far{uniform(-0.1, 0.1), uniform(-0.1, 0.1), 0};
  for (Vec3& x : made.state.x) {
    x += Vec3{stretch * x.x * x.x / length - bend * x.x * x.z, bend * x.x * x.y, bend * x.x * x.x / 2};
    x = Vec3{std::cos(angle) * x.x - std::sin(angle) * x.y, std::sin(angle) * x.x + std::cos(angle) * x.y, x.z} + far;
  }
  return made;
}

// Of each cluster, with the weights m / n or with whole masses; all of these clusters have an extent along every axis.
std::vector<double> stretches(const BentBlock& block, bool whole_masses) {
  const Body& body = block.setup.body;
  const Clusters& clusters = block.state.clusters;
  std::vector<double> weight = body.mass, found;
  std::vector<int32_t> holders(body.mass.size());
  for (const int32_t i : clusters.members) ++holders[at(i)];
  for (std::size_t i = 0; i < weight.size() && !whole_masses; ++i) weight[i] /= holders[i];
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    Eigen::MatrixXd rest(members.size(), 3), now(members.size(), 3);
    Eigen::VectorXd w(members.size());
    for (std::size_t k = 0; k < members.size(); ++k) {
      const Vec3 X = body.rest_position(members[k]), x = block.state.x[at(members[k])];
      rest.row(static_cast<Eigen::Index>(k)) << X.x, X.y, X.z;
      now.row(static_cast<Eigen::Index>(k)) << x.x, x.y, x.z;
      w[static_cast<Eigen::Index>(k)] = weight[at(members[k])];
    }
    rest.rowwise() -= (w.transpose() * rest) / w.sum();
    now.rowwise() -= (w.transpose() * now) / w.sum();
    // The affine map that fits best: now ≈ rest Fᵀ by weighted least squares.
    const Eigen::VectorXd root = w.cwiseSqrt();
    const Eigen::MatrixXd fit = (root.asDiagonal() * rest).colPivHouseholderQr().solve(root.asDiagonal() * now);
    found.push_back(fit.jacobiSvd().singularValues()[0]);
  }
  return found;
}

State removed_by(const BentBlock& block, const std::vector<double>& stretch) {
  State after = block.state;
  for (int32_t c = 0; c < after.clusters.count(); ++c) {
    if (stretch[at(c)] <= block.setup.detect.strain) continue;
    for (const int32_t i : after.clusters.of(c)) after.alive[at(i)] = 0;
  }
  for (int32_t i = 0; i < block.setup.body.particle_count(); ++i) {
    if (after.alive[at(i)] == 0) after.removed.push_back(i);
  }
  return after;
}

TEST(StrainOfBentBlocks, IsWeighedAlikeByOracleReferenceAndKernelsAndNotByWholeMasses) {
  constexpr uint64_t kSeed = 44;
  std::mt19937_64 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  int cut = 0, whole_masses_differ = 0, rejected = 0;
  constexpr int kBlocks = 300;
  for (int round = 0; round < kBlocks; ++round) {
    SCOPED_TRACE(round);
    BentBlock block = bent_block(random);
    const std::vector<double> stretch = stretches(block, false), of_whole_masses = stretches(block, true);
    // Between two clusters, so that one of them goes and the other stays.
    std::vector<double> sorted = stretch;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t middle = random() % sorted.size();
    block.setup.detect.strain = middle == 0 ? 0.999 * sorted[0] : (sorted[middle - 1] + sorted[middle]) / 2;

    const State wanted = removed_by(block, stretch);
    cut += !wanted.removed.empty();
    EXPECT_TRUE(oracles::detection(block.setup, block.state, wanted).holds);
    State by_reference = block.state;
    reference::detect(block.setup, by_reference);
    EXPECT_EQ(by_reference.removed, wanted.removed);
    // Single precision may stand on the other side of a threshold that two clusters are this close to.
    const auto host = gpu::make_host_backend(1);
    host->load({block.setup}, {block.state});
    const State before = host->snapshot().front();
    host->run({Stage::detect, Stage::detect});
    const State by_kernels = host->snapshot().front();
    EXPECT_TRUE(oracles::detection(block.setup, before, by_kernels).holds);
    const bool is_close = std::any_of(stretch.begin(), stretch.end(),
                                      [&](double s) { return std::abs(s / block.setup.detect.strain - 1) < 1e-3; });
    if (!is_close) {
      EXPECT_EQ(by_kernels.removed, wanted.removed);
    }

    State otherwise = removed_by(block, of_whole_masses);
    if (otherwise.removed == wanted.removed) continue;
    ++whole_masses_differ;
    rejected += !oracles::detection(block.setup, block.state, otherwise).holds;
    otherwise.precision = before.precision;
    State single = block.state;
    single.precision = before.precision;
    if (!is_close) {
      EXPECT_FALSE(oracles::detection(block.setup, single, otherwise).holds);
    }
  }
  EXPECT_GT(cut, kBlocks / 2);
  EXPECT_GT(whole_masses_differ, kBlocks / 20);
  EXPECT_EQ(rejected, whole_masses_differ);
}

// Bodies and clusters of every kind: sheets and wires, single particles, clusters that are flat or straight, where the
// motion is bent, torn or turned inside out.
TEST(StrainOfAnyClusters, IsJudgedAlikeByOracleReferenceAndKernels) {
  constexpr uint64_t kSeed = 45;
  std::mt19937_64 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  int64_t removed = 0, kept = 0, flat = 0;
  for (uint64_t round = 0; round < 300; ++round) {
    SCOPED_TRACE(round);
    Instance made = instance_of(draw_case(kSeed + round, 50));
    made.setup.has_blade = false;
    made.setup.blade_moves.clear();
    made.setup.stroke_end.clear();
    made.setup.step.substeps = 1;
    made.setup.substep_length = {1e-3};  // one frame, however many strokes the case has
    made.setup.detect = {Criterion::strain, RemovedEnds::both, 1.5, uniform(1.01, 1.4), true};
    const double h = made.setup.body.grid.spacing;
    for (double& m : made.setup.body.mass) m *= uniform(0.5, 2);
    reference::update_rest_frames(made.setup.body, made.state.clusters);
    const double bend = uniform(0, 0.05) / h, noise = round % 4 == 0 ? uniform(0, 0.3) * h : 0, turn = uniform(0, 3);
    for (Vec3& x : made.state.x) {
      x += Vec3{-bend * x.x * x.z, bend * x.x * x.y, bend * x.x * x.x / 2};
      x += noise * Vec3{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      x = {std::cos(turn) * x.x - std::sin(turn) * x.y, std::sin(turn) * x.x + std::cos(turn) * x.y, x.z};
      if (round % 16 == 1) x.z = -x.z;
    }
    for (int32_t c = 0; c < made.state.clusters.count(); ++c) flat += made.state.clusters.size(c) < 4;
    State by_reference = made.state;
    reference::detect(made.setup, by_reference);
    const Verdict verdict = oracles::detection(made.setup, made.state, by_reference);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
    removed += static_cast<int64_t>(by_reference.removed.size());
    kept += std::count(by_reference.alive.begin(), by_reference.alive.end(), 1);
    const auto host = gpu::make_host_backend(1);
    host->load({made.setup}, {made.state});
    const State before = host->snapshot().front();
    host->run({Stage::detect, Stage::detect});
    const Verdict of_kernels = oracles::detection(made.setup, before, host->snapshot().front());
    EXPECT_TRUE(of_kernels.holds) << of_kernels.witness.text;
  }
  EXPECT_GT(removed, 1000);
  EXPECT_GT(kept, 1000);
  EXPECT_GT(flat, 1000);
}

// A particle alone has no extent that could be stretched, whatever rounding makes of its own center.
TEST(StrainOfSingleParticles, IsNone) {
  std::mt19937_64 random(46);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  std::vector<std::array<int32_t, 3>> nodes;
  std::vector<std::vector<int32_t>> clusters;
  for (int32_t i = 0; i < 2000; ++i) {
    nodes.push_back({2 * (i % 13), 2 * (i / 13 % 13), 2 * (i / 169)});
    clusters.push_back({i});
  }
  std::sort(nodes.begin(), nodes.end(),
            [](const auto& a, const auto& b) { return std::tuple(a[2], a[1], a[0]) < std::tuple(b[2], b[1], b[0]); });
  cutproof::Setup setup;
  setup.body = fixtures::body_from_nodes(nodes, 0.01);
  for (double& m : setup.body.mass) m *= uniform(0.5, 2);
  setup.step.substeps = 1;
  setup.substep_length = {1e-3};
  setup.detect = {Criterion::strain, RemovedEnds::both, 1.5, 1.01, true};
  State state = fixtures::foreign_state(setup.body, clusters, 1, 1);
  for (Vec3& x : state.x) x += {uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(-0.1, 0.1)};
  State by_reference = state;
  reference::detect(setup, by_reference);
  EXPECT_EQ(by_reference.removed.size(), 0u);
  const auto host = gpu::make_host_backend(1);
  host->load({setup}, {state});
  const State before = host->snapshot().front();
  host->run({Stage::detect, Stage::detect});
  EXPECT_EQ(host->snapshot().front().removed.size(), 0u);
  EXPECT_TRUE(oracles::detection(setup, state, state).holds);
  EXPECT_TRUE(oracles::detection(setup, before, before).holds);
}

}  // namespace
}  // namespace cutproof::property_tests::bent_strain_test
