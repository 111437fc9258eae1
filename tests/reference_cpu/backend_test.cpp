// The reference through the backend contract: which stages run, how a frame is composed, what it refuses.
#include <gtest/gtest.h>

#include <stdexcept>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference::backend_test {
namespace {

// A block of 8 × 6 × 6 nodes and a blade that goes down through its middle, one quarter in each of four frames.
Setup cut_block(Criterion criterion) {
  cutproof::Setup setup;
  setup.body = fixtures::block(8, 6, 6, 0.01);
  setup.detect.criterion = criterion;
  setup.step.substeps = 2;
  setup.substep_length.assign(4, 0.002);
  setup.has_blade = true;
  setup.blade = {0.2, 0.2, 0.001, 0};
  for (int s = 0; s < 8; ++s) {
    const auto pose = [](int k) { return BladePose{{0.045, 0.035, 0.07 - 0.01 * k}, {0, 1, 0}, {0, 0, 1}}; };
    setup.blade_moves.push_back({pose(s), pose(s + 1), true, 0});
  }
  return setup;
}

State cooked(const Setup& setup) {
  ClusterSpec spec;
  spec.side = 3;
  return fixtures::cook(setup.body, spec, setup.expand, setup.merge, 1);
}

std::array<bool, 6> stages_of_a_frame(const Setup& setup, const State& state) {
  const auto backend = make_backend();
  backend->load({setup}, {state});
  backend->run({});
  return backend->report().ran;
}

TEST(ReferenceBackend, RunsNoClusterStageInAFrameThatRemovedNothing) {
  cutproof::Setup setup = cut_block(Criterion::geometric);
  setup.blade_moves[0].down = setup.blade_moves[1].down = false;
  EXPECT_EQ(stages_of_a_frame(setup, cooked(setup)), (std::array<bool, 6>{true, true, false, false, false, true}));
}

TEST(ReferenceBackend, RunsNoDetectionWithoutABlade) {
  cutproof::Setup setup = cut_block(Criterion::distance);
  setup.has_blade = false;
  setup.blade_moves.clear();
  EXPECT_EQ(stages_of_a_frame(setup, cooked(setup)), (std::array<bool, 6>{true, false, false, false, false, true}));
}

TEST(ReferenceBackend, RunsNoExpansionWhereTheClustersCoverEveryEdge) {
  const cutproof::Setup setup = cut_block(Criterion::geometric);
  EXPECT_EQ(stages_of_a_frame(setup, cooked(setup)), (std::array<bool, 6>{true, true, true, true, false, true}));
}

TEST(ReferenceBackend, RunsExpansionOnceForForeignClustersAndThenNoMore) {
  cutproof::Setup setup = cut_block(Criterion::geometric);
  State state = cooked(setup);
  state.edge_covered = false;
  const auto backend = make_backend();
  backend->load({setup}, {state});
  std::vector<bool> ran;
  for (int frame = 0; frame < 4; ++frame) {
    backend->run({});
    const auto report = backend->report();
    if (report.ran[static_cast<std::size_t>(Stage::split)]) {
      ran.push_back(report.ran[static_cast<std::size_t>(Stage::expand)]);
    }
  }
  ASSERT_GE(ran.size(), 2u);
  EXPECT_TRUE(ran.front());
  for (std::size_t k = 1; k < ran.size(); ++k) EXPECT_FALSE(ran[k]);
}

TEST(ReferenceBackend, MakesNoSkinWhereNoneIsWanted) {
  cutproof::Setup setup = cut_block(Criterion::geometric);
  setup.skin.wanted = false;
  const auto backend = make_backend();
  backend->load({setup}, {cooked(setup)});
  backend->run({});
  EXPECT_FALSE(backend->report().ran[5]);
  const State state = backend->snapshot().front();
  EXPECT_TRUE(state.skin.triangles.empty());
  EXPECT_EQ(state.frame, 1) << "the frame is over all the same";
}

TEST(ReferenceBackend, AFrameIsTheCompositionOfItsSpansBitForBit) {
  for (const Criterion criterion : {Criterion::geometric, Criterion::distance}) {
    const cutproof::Setup setup = cut_block(criterion);
    const State state = cooked(setup);
    const auto whole = make_backend(), parts = make_backend();
    whole->load({setup}, {state});
    parts->load({setup}, {state});
    int64_t removed = 0;
    for (int frame = 0; frame < 4; ++frame) {
      whole->run({});
      for (const Stage stage : kStages) parts->run({stage, stage});
      EXPECT_EQ(whole->snapshot(), parts->snapshot()) << "frame " << frame;
      removed += static_cast<int64_t>(whole->snapshot().front().removed.size());
    }
    EXPECT_GT(removed, 0);
  }
}

TEST(ReferenceBackend, RunsManyBodiesAsItRunsEach) {
  const cutproof::Setup one = cut_block(Criterion::distance);
  cutproof::Setup other = cut_block(Criterion::geometric);
  other.substep_length.pop_back();
  other.blade_moves.resize(6);
  const auto together = make_backend(), first = make_backend(), second = make_backend();
  together->load({one, other}, {cooked(one), cooked(other)});
  first->load({one}, {cooked(one)});
  second->load({other}, {cooked(other)});
  for (int frame = 0; frame < 4; ++frame) {
    together->run({});
    first->run({});
    second->run({});
  }
  EXPECT_EQ(together->snapshot()[0], first->snapshot()[0]);
  EXPECT_EQ(together->snapshot()[1], second->snapshot()[0]);
  EXPECT_EQ(together->snapshot()[1].frame, 3) << "its schedule was over";
}

TEST(ReferenceBackend, RefusesAStateThatDoesNotFitItsSetup) {
  const cutproof::Setup setup = cut_block(Criterion::distance);
  const auto backend = make_backend();
  EXPECT_THROW(backend->load({setup}, {}), std::invalid_argument);
  State few = cooked(setup);
  few.x.pop_back();
  EXPECT_THROW(backend->load({setup}, {few}), std::invalid_argument);
  State beyond = cooked(setup);
  beyond.clusters.members.back() = setup.body.particle_count();
  EXPECT_THROW(backend->load({setup}, {beyond}), std::invalid_argument);
  cutproof::Setup timeless = setup;
  timeless.blade_moves.pop_back();
  EXPECT_THROW(backend->load({timeless}, {cooked(setup)}), std::invalid_argument);
}

TEST(ReferenceBackend, EndsWithAReportWhenTheBodyIsCutAwayEntirely) {
  cutproof::Setup setup = cut_block(Criterion::geometric);
  setup.blade.thickness = 1;  // thicker than the body
  const auto backend = make_backend();
  backend->load({setup}, {cooked(setup)});
  for (int frame = 0; frame < 4; ++frame) backend->run({});
  const State state = backend->snapshot().front();
  EXPECT_EQ(state.clusters.count(), 0);
  EXPECT_TRUE(state.skin.triangles.empty());
  EXPECT_EQ(state.frame, 4);
}

}  // namespace
}  // namespace cutproof::reference::backend_test
