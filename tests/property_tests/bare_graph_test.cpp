// Tissue that is handed over as a graph alone: the same verdicts as on its grid, and bodies that no grid has.
#include "model/bare_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "harness/backends.h"
#include "model/backend.h"
#include "model/io/setup_check.h"
#include "oracles/judge.h"
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "property_tests/cases.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests::bare_graph_test {
namespace {

constexpr uint64_t kSeed = 1;

const oracles::PropertyLists& lists() {
  static const oracles::PropertyLists all = {&oracles::core_properties(), &oracles::motion_properties()};
  return all;
}

Setup without_grid(Setup setup) {
  setup.body = as_bare_graph(setup.body);
  return setup;
}

// Everything that is asked of one stage and of the state after it.
std::vector<Verdict> asked_of(const Setup& setup, Stage stage, const State& before, const State& after) {
  std::vector<Verdict> verdicts = oracles::judge_stage(setup, stage, before, after, lists());
  for (Verdict& verdict : oracles::judge(setup, after, stage, true, lists())) verdicts.push_back(std::move(verdict));
  return verdicts;
}

// One thing wrong, of the kind that leaves a state well formed.
void disturb(State& state, std::mt19937_64& random) {
  const auto any = [&](std::size_t count) { return random() % count; };
  Clusters& clusters = state.clusters;
  if (state.x.empty() || clusters.members.empty()) return;
  const std::size_t i = any(state.x.size());
  switch (random() % 7) {
    case 0:
      state.x[i].y += 0.01;  // some spacings
      break;
    case 1:
      state.v[i].x += 1e-3;
      break;
    case 2:
      state.alive[i] = state.alive[i] != 0 ? 0 : 1;
      break;
    case 3:
      clusters.members[any(clusters.members.size())] = static_cast<int32_t>(i);
      break;
    case 4:
      clusters.members.pop_back();
      for (int64_t& end : clusters.offsets) end = std::min(end, static_cast<int64_t>(clusters.members.size()));
      break;
    case 5:
      state.edge_covered = true;
      break;
    default:
      state.removed.assign(1, static_cast<int32_t>(i));
  }
}

struct Counted {
  int64_t stages = 0, cutting = 0, rejected = 0;
};

// Runs a case both ways, with every stage judged both ways, as it is and with something wrong.
void compare_ways(Instance instance, std::mt19937_64& random, Counted& counted) {
  instance.setup.skin.wanted = false;
  const Setup bare = without_grid(instance.setup);
  const auto on_grid = reference::make_backend(), on_graph = reference::make_backend();
  on_grid->load({instance.setup}, {instance.state});
  on_graph->load({bare}, {instance.state});
  for (int64_t frame = 0; frame < instance.setup.frame_count(); ++frame) {
    for (const Stage stage : kStages) {
      const State before = on_grid->snapshot().front();
      on_grid->run({stage, stage});
      on_graph->run({stage, stage});
      const State after = on_grid->snapshot().front();
      ASSERT_EQ(after, on_graph->snapshot().front()) << "frame " << frame << ", " << name_of(stage);
      ++counted.stages;
      if (stage == Stage::detect && !after.removed.empty()) ++counted.cutting;
      ASSERT_EQ(asked_of(instance.setup, stage, before, after), asked_of(bare, stage, before, after));
      State wrong = after;
      disturb(wrong, random);
      const std::vector<Verdict> verdicts = asked_of(instance.setup, stage, before, wrong);
      ASSERT_EQ(verdicts, asked_of(bare, stage, before, wrong));
      counted.rejected += std::any_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return !v.holds; });
    }
  }
}

TEST(BareGraph, HasTheSameStatesAndVerdictsAsItsGrid) {
  std::mt19937_64 random(kSeed);
  Counted counted;
  for (uint64_t k = 0; k < 60; ++k) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", case " + std::to_string(k));
    const int size = static_cast<int>(k % 60);
    compare_ways(instance_of(draw_case(kSeed + k, size)), random, counted);
    if (HasFatalFailure()) return;
    compare_ways(instance_of(draw_moving_case(kSeed + k, size)), random, counted);
    if (HasFatalFailure()) return;
  }
  // What was compared is not nothing.
  EXPECT_GT(counted.stages, 2000);
  EXPECT_GT(counted.cutting, 100);
  EXPECT_GT(counted.rejected, counted.stages / 3);
}

// Points at random in a cube of five spacings, joined where they are near; each with its neighbours is a cluster. A
// body like this has edges of every length, and particles with more than six.
struct Cloud {
  Setup setup;
  State state;
};
Cloud cloud(std::mt19937_64& random) {
  const auto drawn = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  Cloud c;
  Body& body = c.setup.body;
  body.name = "cloud";
  for (int i = 0; i < 150; ++i) body.rest.push_back({drawn(0, 5), drawn(0, 5), drawn(0, 5)});
  body.mass.assign(body.rest.size(), 1e-3);
  body.edge_offsets = {0};
  for (std::size_t i = 0; i < body.rest.size(); ++i) {
    for (std::size_t j = 0; j < body.rest.size(); ++j) {
      const double length = norm(body.rest[i] - body.rest[j]);
      if (i == j || length > 1.3) continue;
      body.edge_ends.push_back(static_cast<int32_t>(j));
      body.grid.spacing = std::max(body.grid.spacing, length);
    }
    body.edge_offsets.push_back(static_cast<int64_t>(body.edge_ends.size()));
  }
  c.setup.skin.wanted = false;
  c.setup.detect.without_blade = true;
  c.setup.substep_length = {1e-3, 1e-3};
  State& state = c.state;
  state.x = body.rest;
  state.v.assign(state.x.size(), Vec3{});
  state.alive.assign(state.x.size(), 1);
  state.cap = 64;
  state.tau = 3;
  Clusters& clusters = state.clusters;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    std::vector<int32_t> members = {i};
    for (const int32_t other : body.neighbours(i)) members.push_back(other);
    std::sort(members.begin(), members.end());
    clusters.members.insert(clusters.members.end(), members.begin(), members.end());
    clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
    clusters.number.push_back(i);
    clusters.rotation.push_back(Mat3{});
    clusters.degenerate.push_back(0);
  }
  clusters.rest_center.resize(clusters.number.size());
  clusters.mass.resize(clusters.number.size());
  reference::update_rest_frames(body, clusters);
  return c;
}

std::string first_failure(const std::vector<Verdict>& verdicts) {
  for (const Verdict& verdict : verdicts) {
    if (!verdict.holds) return verdict.property + ": " + verdict.witness.text;
  }
  return "";
}

TEST(BareGraph, RunsWithoutAGrid) {
  std::mt19937_64 random(kSeed);
  int64_t removed = 0, most = 0;
  for (int k = 0; k < 10; ++k) {
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", cloud " + std::to_string(k));
    Cloud c = cloud(random);
    for (int32_t i = 0; i < c.setup.body.particle_count(); ++i) {
      most = std::max(most, c.setup.body.neighbours(i).size());
    }
    // Pulled apart along x, beyond a plane.
    for (Vec3& x : c.state.x) x.x += x.x > 2.5 ? 1.5 : 0.0;
    const auto backend = reference::make_backend();
    backend->load({c.setup}, {c.state});
    for (int frame = 0; frame < 2; ++frame) {
      for (const Stage stage : {Stage::step, Stage::detect, Stage::split, Stage::merge, Stage::expand, Stage::skin}) {
        const State before = backend->snapshot().front();
        backend->run({stage, stage});
        const State after = backend->snapshot().front();
        if (stage == Stage::detect) removed += static_cast<int64_t>(after.removed.size());
        ASSERT_EQ(first_failure(asked_of(c.setup, stage, before, after)), "") << name_of(stage);
      }
    }
  }
  EXPECT_GT(removed, 100);
  EXPECT_GT(most, 6);
}

// An edge is too long beyond ε times its own rest length, however long others are.
TEST(BareGraph, MeasuresEachEdgeByItsOwnRestLength) {
  Cloud c;
  Body& body = c.setup.body;
  body.grid.spacing = 2;
  body.rest = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}};  // edges of 1 and 2
  body.edge_offsets = {0, 1, 3, 4};
  body.edge_ends = {1, 0, 2, 1};
  body.mass = {1, 1, 1};
  c.setup.skin.wanted = false;
  c.setup.detect.without_blade = true;
  c.setup.substep_length = {1e-3};
  State& before = c.state;
  before.x = {{0, 0, 0}, {1.6, 0, 0}, {4.4, 0, 0}};  // 1.6 and 1.4 times as long
  before.v.assign(3, Vec3{});
  before.alive = {1, 1, 1};
  before.clusters.members = {0, 1, 2};
  before.clusters.offsets = {0, 3};
  before.clusters.number = {0};
  before.clusters.rotation = {Mat3{}};
  before.clusters.degenerate = {0};
  before.clusters.rest_center.resize(1);
  before.clusters.mass.resize(1);
  reference::update_rest_frames(body, before.clusters);
  State after = before;
  reference::detect(c.setup, after);
  EXPECT_EQ(after.removed, (std::vector<int32_t>{0, 1}));
  EXPECT_TRUE(oracles::detection(c.setup, before, after).holds);
  State none = before;
  EXPECT_FALSE(oracles::detection(c.setup, before, none).holds);  // though no edge is longer than ε h
  State all = before;
  all.alive = {0, 0, 0};
  all.removed = {0, 1, 2};
  EXPECT_FALSE(oracles::detection(c.setup, before, all).holds);
}

// Not as what a scene could not mean, nor as a failing machine: as something that they do not do.
TEST(BareGraph, IsRefusedByKernels) {
  std::mt19937_64 random(kSeed);
  const Cloud right = cloud(random);
  for (const harness::BackendDescriptor& described : harness::backends()) {
    if (!described.is_built() || described.needs_device()) continue;
    const std::unique_ptr<Backend> backend = harness::make_backend({.name = std::string(described.name)});
    if (described.is_the_reference) {
      EXPECT_NO_THROW(backend->load({right.setup}, {right.state}));
    } else {
      EXPECT_THROW(backend->load({right.setup}, {right.state}), Refused) << described.name;
    }
  }
}

TEST(BareGraph, IsRefusedWithEdgesThatAreNone) {
  std::mt19937_64 random(kSeed);
  const Cloud right = cloud(random);
  const auto refused = [&](const char* what, auto&& change) {
    Cloud wrong = right;
    change(wrong.setup.body);
    EXPECT_FALSE(oracles::well_formed(wrong.setup, wrong.state).holds) << what;
    EXPECT_THROW(reference::make_backend()->load({wrong.setup}, {wrong.state}), std::invalid_argument) << what;
    EXPECT_TRUE(io::defect_of(wrong.setup)) << what;
  };
  EXPECT_TRUE(oracles::well_formed(right.setup, right.state).holds);
  refused("one way only", [](Body& b) { b.edge_ends.pop_back(), --b.edge_offsets.back(); });
  refused("beyond the last particle", [](Body& b) { b.edge_ends.front() = b.particle_count(); });
  refused("negative", [](Body& b) { b.edge_ends.front() = -1; });
  refused("to itself", [](Body& b) { b.edge_ends.front() = 0; });
  refused("twice", [](Body& b) { b.edge_ends[1] = b.edge_ends[0]; });
  refused("offsets that descend", [](Body& b) { b.edge_offsets[1] = b.edge_offsets[2] + 1; });
  refused("offsets that end early", [](Body& b) { --b.edge_offsets.back(); });
  refused("an offset too few", [](Body& b) { b.edge_offsets.pop_back(); });
  EXPECT_FALSE(io::defect_of(right.setup));
  Cloud with_skin = right;
  with_skin.setup.skin.wanted = true;
  EXPECT_FALSE(oracles::well_formed(with_skin.setup, with_skin.state).holds);
  EXPECT_TRUE(io::defect_of(with_skin.setup));
  Cloud with_grid = right;
  with_grid.setup.body.node = {0};
  EXPECT_FALSE(oracles::well_formed(with_grid.setup, with_grid.state).holds);
  EXPECT_TRUE(io::defect_of(with_grid.setup));
}

// Turned, mirrored and moved, it does the same.
TEST(BareGraph, IsTheSameTurnedAndMirrored) {
  std::mt19937_64 random(kSeed);
  Cloud c = cloud(random);
  for (Vec3& x : c.state.x) x = {1.1 * x.x, x.y, x.z};
  const auto backend = reference::make_backend();
  for (uint64_t seed = 0; seed < 2 * oracles::kEquivarianceKinds; ++seed) {
    const Verdict verdict = oracles::equivariance(*backend, c.setup, c.state, {}, seed);
    EXPECT_TRUE(verdict.holds) << "seed " << seed << ": " << verdict.witness.text;
    EXPECT_GT(verdict.checked, 0) << "seed " << seed << ": " << verdict.vacuous;
  }
}

}  // namespace
}  // namespace cutproof::property_tests::bare_graph_test
