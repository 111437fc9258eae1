// A backend beside the reference: what is equal is found equal, and a planted deviation is found where it was planted.
#include "harness/against.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "gpu/backends.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/cli/program.h"

namespace cutproof::cli {
namespace {

using Fault = std::function<void(const cutproof::Setup&, State&)>;

// A backend that is right but for what is planted: the state is changed after one stage of one frame (fault) or before
// it (bias), and the backend goes on from there; or the stage is left out.
class Planted final : public Backend {
 public:
  Planted(std::unique_ptr<Backend> inner, Stage stage, int64_t frame, Fault fault, Fault bias = {}, bool skip = false)
      : inner_(std::move(inner)), stage_(stage), frame_(frame), fault_(fault), bias_(bias), skip_(skip) {}

  std::string name() const override { return "planted"; }
  Precision precision() const override { return inner_->precision(); }
  bool can_run(Span span) const override { return span.first == span.last; }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    const bool here = span.first == stage_ && inner_->snapshot().front().frame == frame_;
    if (here && bias_) change(bias_);
    if (here && skip_) {
      report_ = {};
      return;
    }
    inner_->run(span);
    report_ = inner_->report();
    if (here && fault_) change(fault_);
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  void change(const Fault& fault) {
    std::vector<State> states = inner_->snapshot();
    fault(setups_.front(), states.front());
    inner_->load(setups_, std::move(states));
  }
  std::unique_ptr<Backend> inner_;
  Stage stage_;
  int64_t frame_;
  Fault fault_, bias_;
  bool skip_;
  std::vector<Setup> setups_;
  SpanReport report_;
};

fixtures::Built build(const std::string& name, std::optional<int64_t> particles = {}) {
  const std::string file = CUTPROOF_SOURCE "/fixtures/scenes/" + name + ".json";
  fixtures::BuildOptions options;
  options.particles = particles;
  return fixtures::build(io::read_scene(file), file, options);
}

// Runs at most `frames` frames. `precision`: of the state that is loaded, so that the comparison allows for at least
// that.
Against compare(Backend& backend, fixtures::Built& built, int64_t frames, AgainstMode mode = AgainstMode::both,
                Precision precision = Precision::binary64) {
  built.state.precision = precision;
  backend.load({built.setup}, {built.state});
  Against against(built.setup, built.state, backend.snapshot().front(), backend.name(), mode);
  for (int64_t frame = 0; frame < std::min(frames, built.setup.frame_count()); ++frame) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      against.see(stage, backend.snapshot().front(), backend.report().ran[static_cast<std::size_t>(stage)]);
    }
  }
  return against;
}

Verdict verdict_named(const Against& against, const std::string& name) {
  for (const Verdict& verdict : against.verdicts()) {
    if (verdict.property == name) return verdict;
  }
  ADD_FAILURE() << "no verdict named " << name;
  return {};
}

std::string failures(const Against& against) {
  std::string text;
  for (const Verdict& verdict : against.verdicts()) {
    if (!verdict.holds) text += verdict.property + ": " + verdict.witness.text + "\n";
  }
  return text;
}

// --- What is right --------------------------------------------------------------------------------------------------

TEST(AgainstTheReference, TheReferenceDeviatesByNothingFromItself) {
  for (const char* scene : {"three_cuts", "cuboid_press", "irregular_sampled"}) {
    fixtures::Built built = build(scene);
    const auto backend = reference::make_backend();
    const Against against = compare(*backend, built, 12);
    EXPECT_TRUE(against.holds()) << scene << "\n" << failures(against);
    for (const Verdict& verdict : against.verdicts()) EXPECT_EQ(verdict.measured, 0) << scene << verdict.property;
    EXPECT_FALSE(against.first_difference());
    EXPECT_EQ(against.lockstep().size(), 12u);
    EXPECT_EQ(against.shadow().size(), 12u);
    for (const LockstepFrame& frame : against.lockstep()) {
      EXPECT_EQ(frame.position.rms() + frame.velocity.rms() + frame.skin.rms(), 0);
      EXPECT_GT(frame.position.count, 0);
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

constexpr int64_t kFrame = 6;  // of three_cuts, in which particles are removed and clusters merged
constexpr int32_t kParticle = 40;

Against plant(Stage stage, Fault fault, Fault bias = {}, bool skip = false) {
  static fixtures::Built built = build("three_cuts");
  Planted backend(reference::make_backend(), stage, kFrame, std::move(fault), std::move(bias), skip);
  return compare(backend, built, kFrame + 3);
}

void expect_found(const Against& against, const std::string& property, Stage stage, int64_t frame = kFrame) {
  EXPECT_FALSE(against.holds());
  const Verdict verdict = verdict_named(against, property);
  EXPECT_FALSE(verdict.holds) << failures(against);
  EXPECT_EQ(verdict.stage, stage) << failures(against);
  EXPECT_EQ(verdict.frame, frame) << failures(against);
  EXPECT_FALSE(verdict.witness.text.empty());
}

// In lockstep a deviation shows in its own frame only: everything but this property must hold.
void expect_nothing_else(const Against& against, const std::string& property) {
  for (const Verdict& verdict : against.verdicts()) {
    EXPECT_TRUE(verdict.holds || verdict.property == property || verdict.property.starts_with("shadow"))
        << verdict.property << ": " << verdict.witness.text;
  }
}

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

TEST(APlantedDeviation, OfAThousandthOfTheBoundIsNotAFailure) {
  const Against against = plant(Stage::step, [](const cutproof::Setup& setup, State& state) {
    state.x[kParticle].y += 1e-7 * setup.body.grid.spacing;
  });
  EXPECT_TRUE(against.holds()) << failures(against);
  EXPECT_NEAR(verdict_named(against, "lockstep: positions").measured, 1e-7, 1e-10);
}

TEST(APlantedDeviation, OfAPositionThatIsNotANumberIsFound) {
  const Against against = plant(Stage::step, [](const cutproof::Setup&, State& state) {
    state.x[kParticle].y = std::numeric_limits<double>::quiet_NaN();
  });
  expect_found(against, "lockstep: positions", Stage::step);
  EXPECT_EQ(against.to_json()["lockstep"]["frames"]["position_max"][kFrame], "inf");
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
  EXPECT_NEAR(against.lockstep()[kFrame].angle.greatest, 1e-2, 1e-6);
}

TEST(APlantedDeviation, OfARotationThatAMergeForgetsIsFound) {
  const Against against = plant(Stage::merge, [](const cutproof::Setup&, State& state) {
    state.clusters.rotation[5] = Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  });
  expect_found(against, "lockstep: topology", Stage::merge);
}

class AForgottenRemoval : public testing::TestWithParam<const char*> {};
TEST_P(AForgottenRemoval, IsFoundInLockstepAndInTheShadow) {
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

  expect_found(against, "shadow: decisions", Stage::detect, frame);
  ASSERT_TRUE(against.first_difference());
  EXPECT_EQ(against.first_difference()->what.particles, std::vector<int32_t>{forgotten});
  EXPECT_EQ(against.first_difference()->margin.has_value(), built.setup.detect.criterion == Criterion::distance);
  if (against.first_difference()->margin) {
    EXPECT_GT(*against.first_difference()->margin, against.first_difference()->reach);
  }
  EXPECT_EQ(against.shadow().size(), static_cast<std::size_t>(frame + 1)) << "compared until they differ";
  EXPECT_EQ(against.lockstep().size(), static_cast<std::size_t>(frame + 3));
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
  expect_found(against, "shadow: decisions", Stage::split);
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
  EXPECT_EQ(round.lockstep()[kFrame].topology_differences, 0) << failures(round);
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

// --- Either ---------------------------------------------------------------------------------------------------------

TEST(WithinItsRounding, ARemovalIsEitherInLockstepAndExplainedInTheShadow) {
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
  EXPECT_EQ(against.lockstep().front().removals_either, 2);
  ASSERT_TRUE(against.first_difference());
  EXPECT_TRUE(against.first_difference()->explained);
  EXPECT_EQ(against.first_difference()->what.particles,
            (std::vector<int32_t>{std::min(end, other), std::max(end, other)}));
  EXPECT_NEAR(*against.first_difference()->margin, setup.detect.epsilon * 0x1p-26, 1e-12);
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

TEST(WithinItsRounding, TheSideOfTheBladeIsEither) {
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
  EXPECT_GT(against.lockstep().front().sides_taken_otherwise, 0);
  EXPECT_GE(against.lockstep().front().sides_either, against.lockstep().front().particles_excluded);
  EXPECT_GT(against.lockstep().front().position.count, 0);
  // In double precision there is no such excuse.
  EXPECT_FALSE(compare(backend, built, 1, AgainstMode::lockstep).holds());
}

TEST(WithinItsRounding, AParticleThatOneRoundingThrowsFarIsEither) {
  // Particles so near to the cutting edge that the direction in which it pushes them turns with the least change.
  fixtures::Built built = block_with_blade(1e-3);
  built.setup.step.iterations = 0;
  built.setup.step.gravity = {};
  const Fault nudge = [](const cutproof::Setup& setup, State& state) {
    for (Vec3& x : state.x) x.x += 2e-7 * setup.body.grid.spacing;
  };
  Planted backend(reference::make_backend(), Stage::step, 0, {}, nudge);
  const Against against = compare(backend, built, 1, AgainstMode::lockstep, Precision::binary32);
  EXPECT_TRUE(against.holds()) << failures(against);
  EXPECT_GT(against.lockstep().front().sensitive_either, 0);
  EXPECT_LT(against.lockstep().front().particles_excluded, built.setup.body.particle_count() / 4);
  EXPECT_FALSE(compare(backend, built, 1, AgainstMode::lockstep).holds());

  // What no rounding does is found among them all the same.
  const Fault shift = [](const cutproof::Setup& setup, State& state) {
    for (Vec3& x : state.x) x.y += 1e-3 * setup.body.grid.spacing;
  };
  Planted shifted(reference::make_backend(), Stage::step, 0, shift);
  EXPECT_FALSE(compare(shifted, built, 1, AgainstMode::lockstep, Precision::binary32).holds());
}

TEST(WithinItsRounding, AFreeAxisOfACollinearClusterIsEither) {
  cutproof::Setup setup;
  setup.body = fixtures::block(5, 1, 1);
  State state;
  for (int32_t i = 0; i < 5; ++i) state.x.push_back(setup.body.rest_position(i));
  state.v.resize(5);
  state.alive.assign(5, 1);
  state.clusters.offsets = {0, 5};
  state.clusters.members = {0, 1, 2, 3, 4};
  state.clusters.number = {0};
  state.clusters.rotation.resize(1);
  State turned = state;
  turned.clusters.rotation[0] = Mat3{{1, 0, 0, 0, 0, -1, 0, 1, 0}};  // about the wire
  const std::vector<oracles::Turn> turns = oracles::turns_apart(setup, state, turned);
  ASSERT_EQ(turns.size(), 1u);
  EXPECT_FALSE(turns[0].unique);
  EXPECT_FALSE(turns[0].moves_members) << "its free axis moves no member";
}

// --- The program ----------------------------------------------------------------------------------------------------

class TheProgram : public Program {};
const std::string kScene = "'" CUTPROOF_SOURCE "/fixtures/scenes/small_block.json'";

TEST_F(TheProgram, ComparesTheKernelsWithTheReferenceAndWritesEveryFrame) {
  const Outcome outcome = cutproof("run " + kScene + " --frames 12 --backend host --against reference --json out.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("lockstep: topology"), std::string::npos) << outcome.output;
  const nlohmann::json document = nlohmann::json::parse(read("out.json"));
  const nlohmann::json& against = document["against"];
  EXPECT_EQ(against["mode"], "both");
  EXPECT_EQ(against["holds"], true);
  EXPECT_EQ(against["verdicts"].size(), 9u);
  const std::size_t frames = document["frames"].size();
  EXPECT_EQ(frames, 12u);
  for (const auto& [name, column] : against["lockstep"]["frames"].items()) EXPECT_EQ(column.size(), frames) << name;
  EXPECT_EQ(against["shadow"]["frames"]["position_rms"].size(), frames);
  EXPECT_GT(against["lockstep"]["frames"]["position_max"][5], 0.0);
}

TEST_F(TheProgram, ComparesInOneModeOnlyIfAsked) {
  const Outcome lockstep = cutproof("run " + kScene + " --frames 2 --against reference --mode lockstep");
  EXPECT_EQ(lockstep.status, 0);
  EXPECT_EQ(lockstep.output.find("shadow"), std::string::npos) << lockstep.output;
  const Outcome shadow = cutproof("run " + kScene + " --frames 2 --against reference --mode shadow --check");
  EXPECT_EQ(shadow.output.find("lockstep"), std::string::npos) << shadow.output;
  EXPECT_NE(shadow.output.find("cluster connectivity"), std::string::npos) << "--check works beside it";
}

TEST_F(TheProgram, RefusesToCompareWithAnythingElse) {
  const Outcome outcome = cutproof("run " + kScene + " --against host");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.output.find("'host' is nothing to compare with"), std::string::npos) << outcome.output;
  EXPECT_EQ(cutproof("run " + kScene + " --against reference --mode loose").status, 2);
  EXPECT_EQ(cutproof("run " + kScene + " --mode lockstep").status, 2);
}

}  // namespace
}  // namespace cutproof::cli
