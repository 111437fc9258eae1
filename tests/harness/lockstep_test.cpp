// A backend beside the reference: what is equal is found equal, and a planted deviation is found where it was planted.
#include "harness/lockstep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "cli/against_report.h"
#include "fixtures/bodies.h"
#include "gpu/backends.h"
#include "harness/reference_stages.h"
#include "tests/harness/planted.h"

namespace cutproof::harness::lockstep_test {
namespace {

// --- What is right --------------------------------------------------------------------------------------------------

TEST(AgainstTheReference, TheReferenceDeviatesByNothingFromItself) {
  for (const char* scene : {"three_cuts", "cuboid_press", "irregular_sampled"}) {
    fixtures::Built built = build(scene);
    const auto backend = reference::make_backend();
    const Against against = compare(*backend, built, 12);
    EXPECT_TRUE(against.holds()) << scene << "\n" << failures(against);
    for (const Verdict& verdict : against.verdicts()) {
      // Rest centers are held against sums of the oracles' own, in another order.
      const double rounding = verdict.property == "lockstep: rest centers" ? 1e-12 : 0;
      EXPECT_LE(verdict.measured, rounding) << scene << verdict.property;
    }
    EXPECT_FALSE(against.free_running->first_difference());
    EXPECT_EQ(against.lockstep->frames().size(), 12u);
    EXPECT_EQ(against.free_running->frames().size(), 12u);
    for (const LockstepFrame& frame : against.lockstep->frames()) {
      EXPECT_EQ(frame.error(Measure::position).rms() + frame.error(Measure::velocity).rms() +
                    frame.error(Measure::skin).rms(),
                0);
      EXPECT_GT(frame.error(Measure::position).count, 0);
    }
  }
}

TEST(AgainstTheReference, TheKernelsAreWithinTheBoundsOnACutBlock) {
  fixtures::Built built = build("three_cuts");
  const auto backend = gpu::make_host_backend(2);
  const Against against = compare(*backend, built, 1000);
  EXPECT_TRUE(against.holds()) << failures(against);
  // Single precision shows: a comparison of the reference with itself would not.
  EXPECT_GT(verdict_named(against, "lockstep: positions").measured, 1e-9);
  EXPECT_GT(verdict_named(against, "lockstep: topology").checked, 6 * 60);
  EXPECT_GT(verdict_named(against, "lockstep: removed particles").checked, 60);
  EXPECT_GT(verdict_named(against, "lockstep: masses").checked, 0);
}

TEST(AgainstTheReference, TheKernelsAreWithinTheBoundsOnACutKidney) {
  fixtures::Built built = build("kidney_discontinuous", 3000);
  const auto backend = gpu::make_host_backend(2);
  const Against against = compare(*backend, built, 40);
  EXPECT_TRUE(against.holds()) << failures(against);
  EXPECT_GT(verdict_named(against, "lockstep: positions").measured, 1e-9);
}

// --- What is planted ------------------------------------------------------------------------------------------------

class AMovedParticle : public testing::TestWithParam<Stage> {};
TEST_P(AMovedParticle, IsFoundInItsStage) {
  const Against against = plant(GetParam(), [](const cutproof::Setup& setup, State& state) {
    state.x[kParticle].y += 1e-3 * setup.body.grid.spacing;
  });
  expect_found(against, "lockstep: positions", GetParam());
  expect_nothing_else(against, "lockstep: positions");
  const Verdict verdict = verdict_named(against, "lockstep: positions");
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{kParticle});
  EXPECT_NEAR(verdict.measured, 1e-3, 1e-9);
}
INSTANTIATE_TEST_SUITE_P(After, AMovedParticle, testing::Values(Stage::step, Stage::split, Stage::merge, Stage::skin),
                         [](const auto& instance) { return std::string(name_of(instance.param)); });

// Nearer than the project asks, and farther than rounding goes.
TEST(APlantedDeviation, OfAThousandthOfTheBoundIsNotAdmissible) {
  const Against against = plant(Stage::step, [](const cutproof::Setup& setup, State& state) {
    state.x[kParticle].y += 1e-7 * setup.body.grid.spacing;
  });
  EXPECT_FALSE(verdict_named(against, "lockstep: admissible step").holds);
  EXPECT_TRUE(verdict_named(against, "lockstep: positions").holds);
  EXPECT_NEAR(verdict_named(against, "lockstep: positions").measured, 1e-7, 1e-10);
}

TEST(APlantedDeviation, OfAPositionThatIsNotANumberIsFound) {
  const Against against = plant(Stage::step, [](const cutproof::Setup&, State& state) {
    state.x[kParticle].y = std::numeric_limits<double>::quiet_NaN();
  });
  expect_found(against, "lockstep: positions", Stage::step);
  EXPECT_EQ(cli::to_json(against, scene().setup)["lockstep"]["frames"]["position_max"][kFrame], "inf");
}

TEST(APlantedDeviation, OfAVelocityIsFound) {
  const Against against = plant(Stage::step, [](const cutproof::Setup& setup, State& state) {
    state.v[kParticle].y += 1e-3 * setup.body.grid.spacing / setup.substep_length[kFrame];
  });
  expect_found(against, "lockstep: velocities", Stage::step);
  expect_nothing_else(against, "lockstep: velocities");
}

TEST(APlantedDeviation, OfARotationIsFound) {
  const Against against = plant(Stage::step, [](const cutproof::Setup&, State& state) {
    const double c = std::cos(1e-2), s = std::sin(1e-2);
    const Mat3 r = state.clusters.rotation[5];
    Mat3& turned = state.clusters.rotation[5];
    for (int column = 0; column < 3; ++column) {
      turned(0, column) = c * r(0, column) - s * r(1, column);
      turned(1, column) = s * r(0, column) + c * r(1, column);
    }
  });
  expect_found(against, "lockstep: rotations", Stage::step);
  EXPECT_EQ(verdict_named(against, "lockstep: rotations").witness.clusters, std::vector<int32_t>{5});
  EXPECT_NEAR(against.lockstep->frames()[kFrame].angle.max, 1e-2, 1e-6);
}

TEST(APlantedDeviation, OfARotationThatAMergeForgetsIsFound) {
  const Against against = plant(Stage::merge, [](const cutproof::Setup&, State& state) {
    state.clusters.rotation[5] = Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  });
  expect_found(against, "lockstep: topology", Stage::merge);
}

class AForgottenRemoval : public testing::TestWithParam<const char*> {};
TEST_P(AForgottenRemoval, IsFoundInLockstepAndRunningFreely) {
  const std::string scene = GetParam();
  fixtures::Built built = scene == "three_cuts" ? build(scene) : build(scene, 2000);
  int64_t frame = 0;
  {
    const auto scout = reference::make_backend();
    scout->load({built.setup}, {built.state});
    for (; frame < built.setup.frame_count(); ++frame) {
      scout->run({Stage::step, Stage::skin});
      if (!scout->snapshot().front().removed.empty()) break;
    }
    ASSERT_LT(frame, built.setup.frame_count());
  }
  int32_t forgotten = -1;
  const Fault forget = [&](const cutproof::Setup&, State& state) {
    ASSERT_FALSE(state.removed.empty());
    forgotten = state.removed.front();
    state.removed.erase(state.removed.begin());
    state.alive[static_cast<std::size_t>(forgotten)] = 1;
  };
  Planted backend(reference::make_backend(), Stage::detect, frame, forget);
  const Against against = compare(backend, built, frame + 3);
  expect_found(against, "lockstep: removed particles", Stage::detect, frame);
  expect_nothing_else(against, "lockstep: removed particles");
  EXPECT_EQ(verdict_named(against, "lockstep: removed particles").witness.particles.front(), forgotten);

  expect_found(against, "free-running: decisions", Stage::detect, frame);
  ASSERT_TRUE(against.free_running->first_difference());
  EXPECT_EQ(against.free_running->first_difference()->what.particles, std::vector<int32_t>{forgotten});
  EXPECT_EQ(against.free_running->first_difference()->margin.has_value(),
            built.setup.detect.criterion == Criterion::distance);
  if (against.free_running->first_difference()->margin) {
    EXPECT_GT(*against.free_running->first_difference()->margin, against.free_running->first_difference()->reach);
  }
  EXPECT_EQ(against.free_running->frames().size(), static_cast<std::size_t>(frame + 1)) << "compared until they differ";
  EXPECT_EQ(against.lockstep->frames().size(), static_cast<std::size_t>(frame + 3));
}
INSTANTIATE_TEST_SUITE_P(Of, AForgottenRemoval, testing::Values("three_cuts", "kidney_discontinuous"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(APlantedDeviation, OfTwoClustersThatExchangeNumbersIsFound) {
  const Against against = plant(Stage::split, [](const cutproof::Setup&, State& state) {
    const Clusters old = state.clusters;
    Clusters& now = state.clusters;
    now.members.clear();
    for (int32_t c = 0; c < old.count(); ++c) {
      const int32_t from = c == 2 ? 7 : c == 7 ? 2 : c;
      const auto members = old.of(from);
      now.members.insert(now.members.end(), members.begin(), members.end());
      now.offsets[static_cast<std::size_t>(c) + 1] = static_cast<int64_t>(now.members.size());
      now.rest_center[static_cast<std::size_t>(c)] = old.rest_center[static_cast<std::size_t>(from)];
      now.mass[static_cast<std::size_t>(c)] = old.mass[static_cast<std::size_t>(from)];
    }
  });
  expect_found(against, "lockstep: topology", Stage::split);
  EXPECT_NE(verdict_named(against, "lockstep: topology").witness.text.find("number"), std::string::npos);
  expect_nothing_else(against, "lockstep: topology");
  expect_found(against, "free-running: decisions", Stage::split);
}

TEST(APlantedDeviation, OfAMemberThatASplitLosesIsFound) {
  const Against against = plant(Stage::split, [](const cutproof::Setup& setup, State& state) {
    Clusters& clusters = state.clusters;
    clusters.members.erase(clusters.members.begin());
    for (std::size_t c = 1; c < clusters.offsets.size(); ++c) --clusters.offsets[c];
    reference::update_rest_frames(setup.body, clusters);
  });
  expect_found(against, "lockstep: topology", Stage::split);
}

TEST(APlantedDeviation, OfARestCenterThatIsStaleIsFound) {
  const Against against = plant(Stage::merge, [](const cutproof::Setup& setup, State& state) {
    state.clusters.rest_center[4].x += 1e-3 * setup.body.grid.spacing;
  });
  expect_found(against, "lockstep: rest centers", Stage::merge);
  EXPECT_EQ(verdict_named(against, "lockstep: rest centers").witness.clusters, std::vector<int32_t>{4});
}

TEST(APlantedDeviation, OfAMassIsFound) {
  const Against against =
      plant(Stage::split, [](const cutproof::Setup&, State& state) { state.clusters.mass[4] *= 1 + 1e-6; });
  expect_found(against, "lockstep: masses", Stage::split);
}

TEST(APlantedDeviation, OfASkinVertexIsFound) {
  const Against against = plant(Stage::skin, [](const cutproof::Setup& setup, State& state) {
    state.skin.position[3].x += 1e-3 * setup.body.grid.spacing;
  });
  expect_found(against, "lockstep: skin vertices", Stage::skin);
  expect_nothing_else(against, "lockstep: skin vertices");
}

TEST(APlantedDeviation, OfATriangleThatIsTurnedOverIsFoundAndOfOneThatIsTurnedRoundIsNone) {
  const Against over = plant(Stage::skin, [](const cutproof::Setup&, State& state) {
    std::swap(state.skin.triangles[8][0], state.skin.triangles[8][1]);
  });
  expect_found(over, "lockstep: topology", Stage::skin);
  const Against round = plant(Stage::skin, [](const cutproof::Setup&, State& state) {
    auto& t = state.skin.triangles[8];
    std::rotate(t.begin(), t.begin() + 1, t.end());
    std::reverse(state.skin.triangles.begin(), state.skin.triangles.end());
  });
  EXPECT_EQ(round.lockstep->frames()[kFrame].topology_differences, 0) << failures(round);
}

TEST(APlantedDeviation, OfAStageThatDoesNotRunIsFound) {
  expect_found(plant(Stage::split, {}, {}, true), "lockstep: topology", Stage::split);
}

TEST(APlantedDeviation, OfAStateThatCannotBeReadIsFoundAndEndsTheComparison) {
  class Torn {
   public:
    static void see(Against& against, State state) {
      state.clusters.members.front() = 1 << 30;
      against.see(Stage::step, state, true);
      against.see(Stage::detect, state, true);
    }
  };
  fixtures::Built built = build("three_cuts");
  Against against(built.setup, built.state, built.state, "torn", AgainstMode::both);
  Torn::see(against, built.state);
  EXPECT_FALSE(verdict_named(against, "lockstep: topology").holds);
  EXPECT_EQ(verdict_named(against, "lockstep: topology").measured, 1);
}

TEST(APlantedDeviation, OfWhatWasLoadedIsFound) {
  fixtures::Built built = build("three_cuts");
  State loaded = built.state;
  loaded.clusters.mass[3] *= 1.001;
  loaded.tau += 1;
  const Against against(built.setup, built.state, loaded, "loads wrongly", AgainstMode::lockstep);
  EXPECT_FALSE(verdict_named(against, "lockstep: masses").holds);
  EXPECT_FALSE(verdict_named(against, "lockstep: topology").holds);
}

// --- Inconclusive ----------------------------------------------------------------------------------------------------

TEST(WithinItsRounding, ARemovalIsUndecidableInLockstepAndExplainedRunningFreely) {
  // The body stretched so that one edge is longer than ε h by a quarter of a rounding in single precision.
  fixtures::Built built = build("uniform_stretch");
  cutproof::Setup& setup = built.setup;
  setup.grips.clear();
  setup.step.iterations = 0;  // nothing moves
  setup.step.gravity = {};
  const int32_t end = 0;
  ASSERT_GE(setup.body.neighbour(end, 0), 0);
  State& state = built.state;
  for (Vec3& v : state.v) v = {};
  const int32_t other = setup.body.neighbour(end, 0);
  const double h = setup.body.grid.spacing;
  state.x[static_cast<std::size_t>(end)] = state.x[static_cast<std::size_t>(other)];
  state.x[static_cast<std::size_t>(end)].x -= setup.detect.epsilon * h * (1 + 0x1p-26);
  const auto keep_all = [](const cutproof::Setup&, State& kept) {
    for (const int32_t i : kept.removed) kept.alive[static_cast<std::size_t>(i)] = 1;
    kept.removed.clear();
  };
  Planted backend(reference::make_backend(), Stage::detect, 0, keep_all);
  const Against against = compare(backend, built, 1, AgainstMode::both, Precision::binary32);
  EXPECT_TRUE(against.holds()) << failures(against);
  EXPECT_EQ(against.lockstep->frames().front().undecidable.removals, 2);
  ASSERT_TRUE(against.free_running->first_difference());
  EXPECT_TRUE(against.free_running->first_difference()->explained);
  EXPECT_EQ(against.free_running->first_difference()->what.particles,
            (std::vector<int32_t>{std::min(end, other), std::max(end, other)}));
  EXPECT_NEAR(*against.free_running->first_difference()->margin, setup.detect.epsilon * 0x1p-26, 1e-12);
  // The same decision is a failure in double precision.
  const Against strict = compare(backend, built, 1, AgainstMode::both);
  EXPECT_FALSE(verdict_named(strict, "lockstep: removed particles").holds);
}

// A block whose middle layer of nodes lies in the plane of a blade that has come halfway down into it, or beside that
// plane by so many h.
fixtures::Built block_with_blade(double beside) {
  fixtures::Built built = build("three_cuts");
  Setup& setup = built.setup;
  const fixtures::Bounds box = fixtures::path_box(setup.body);
  const double h = setup.body.grid.spacing;
  BladePose pose;
  const Vec3 middle = setup.body.rest_position(setup.body.particle_count() / 2);
  pose.edge = {middle.x + beside * h, (box.low.y + box.high.y) / 2, middle.z + beside * h};
  pose.along = {0, 1, 0};
  pose.back = {0, 0, 1};
  setup.blade.length = 100 * h;
  setup.blade.depth = 100 * h;
  setup.has_blade = true;
  setup.detect.criterion = Criterion::distance;  // a geometric blade touches nothing
  for (BladeMove& move : setup.blade_moves) {
    move.from = move.to = pose;
    move.down = true;
  }
  return built;
}

TEST(WithinItsRounding, TheSideOfTheBladeIsUndecidable) {
  fixtures::Built built = block_with_blade(-1e-10);
  const BladePose pose = built.setup.blade_moves.front().from;
  const Vec3 normal = cross(pose.along, pose.back);
  // By less than one rounding, but every tie goes the other way and the layer ends on the other side.
  const Fault across = [&](const cutproof::Setup& setup, State& state) {
    for (Vec3& x : state.x) {
      if (std::abs(dot(x - pose.edge, normal)) < 1e-9 * setup.body.grid.spacing) {
        x -= (1e-9 * setup.body.grid.spacing) * normal;
      }
    }
  };
  Planted backend(reference::make_backend(), Stage::step, 0, {}, across);
  const Against against = compare(backend, built, 1, AgainstMode::lockstep, Precision::binary32);
  EXPECT_TRUE(against.holds()) << failures(against);
  EXPECT_GT(against.lockstep->frames().front().undecidable.otherwise, 0);
  // Of most particles the place where they end tells on which side they began; of those beside the cutting edge not.
  EXPECT_LT(against.lockstep->frames().front().undecidable.inconclusive, built.setup.body.particle_count() / 20);
  EXPECT_GT(against.lockstep->frames().front().error(Measure::position).count, 0);
  // In double precision there is no such excuse.
  EXPECT_FALSE(compare(backend, built, 1, AgainstMode::lockstep).holds());
}

TEST(WithinItsRounding, ANudgeThatNothingRoundsIsFoundWhereTheBladeThrowsFar) {
  // Particles so near to the cutting edge that the direction in which it pushes them turns with the least change. What
  // is kept of them is their displacement, which is 0 and not rounded.
  fixtures::Built built = block_with_blade(1e-3);
  built.setup.step.iterations = 0;
  built.setup.step.gravity = {};
  const Fault nudge = [](const cutproof::Setup& setup, State& state) {
    for (Vec3& x : state.x) x.x += 2e-7 * setup.body.grid.spacing;
  };
  Planted backend(reference::make_backend(), Stage::step, 0, {}, nudge);
  EXPECT_FALSE(compare(backend, built, 1, AgainstMode::lockstep, Precision::binary32).holds());
  EXPECT_FALSE(compare(backend, built, 1, AgainstMode::lockstep).holds());

  // What no rounding does is found among them all the same.
  const Fault shift = [](const cutproof::Setup& setup, State& state) {
    for (Vec3& x : state.x) x.y += 1e-3 * setup.body.grid.spacing;
  };
  Planted shifted(reference::make_backend(), Stage::step, 0, shift);
  EXPECT_FALSE(compare(shifted, built, 1, AgainstMode::lockstep, Precision::binary32).holds());
}

TEST(WithinItsRounding, ARotationAboutAWireIsNotFree) {
  cutproof::Setup setup;
  setup.body = fixtures::block(5, 1, 1);
  setup.substep_length = {0.004};
  State before;
  for (int32_t i = 0; i < 5; ++i) before.x.push_back(setup.body.rest_position(i));
  before.v.resize(5);
  before.alive.assign(5, 1);
  before.clusters.offsets = {0, 5};
  before.clusters.members = {0, 1, 2, 3, 4};
  before.clusters.number = {0};
  before.clusters.rotation.resize(1);
  before.clusters.rest_center.resize(1);
  before.clusters.mass.resize(1);
  before.clusters.degenerate.resize(1);
  reference::update_rest_frames(setup.body, before.clusters);
  State after = before;
  reference::step(setup, after);
  oracles::StageComparison comparison(setup, reference_stages());
  EXPECT_EQ(comparison.compare(Stage::step, before, after, true).undecidable.rotations, 0);

  after.clusters.rotation[0] = Mat3{{1, 0, 0, 0, 0, -1, 0, 1, 0}};  // about the wire
  const oracles::StageDifference found = comparison.compare(Stage::step, before, after, true);
  EXPECT_EQ(found.undecidable.rotations, 0);
  ASSERT_TRUE(found.step);
  EXPECT_FALSE(found.step->holds) << "of all answers the nearest to the previous one";
  EXPECT_FALSE(found.error(Measure::rotation).holds());
  EXPECT_EQ(found.error(Measure::position).norm.count, 5);
}

// What the reference ran for the backend is passed over; if that is all, nothing was compared.
TEST(Lockstep, ComparesOnlyTheStagesThatTheBackendRan) {
  fixtures::Built built = build("small_block");
  const std::unique_ptr<Backend> backend = reference::make_backend();
  const auto compared = [&](std::optional<Stage> own, Stage wrong) {
    backend->load({built.setup}, {built.state});
    Against against(built.setup, built.state, backend->snapshot().front(), "in part", AgainstMode::lockstep);
    for (const Stage stage : kStages) {
      backend->run({stage, stage});
      State after = backend->snapshot().front();
      if (stage == wrong) after.x[0].x += 0.01 * built.setup.body.grid.spacing;
      against.see(stage, after, backend->report().ran[static_cast<std::size_t>(stage)], own == stage);
    }
    return against;
  };
  EXPECT_TRUE(compared(Stage::step, Stage::skin).holds()) << "the skin is not its own";
  EXPECT_FALSE(compared(Stage::step, Stage::step).holds());
  const Against nothing = compared(std::nullopt, Stage::step);
  EXPECT_FALSE(nothing.holds());
  EXPECT_FALSE(verdict_named(nothing, "something was compared").holds);
}

}  // namespace
}  // namespace cutproof::harness::lockstep_test
