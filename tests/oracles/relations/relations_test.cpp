// The relations between runs: the reference passes all of them, and backends made wrong on purpose are rejected with
// the right witness.
#include "oracles/relations/relations.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include "model/at.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::relations_test {
namespace {

using tests::block_body;
using tests::body_of;
using tests::box_clusters;
using tests::Node;
using tests::range;
using tests::round_to_single;
using tests::setup_of;
using tests::state_of;

using StageFunction = std::function<void(const cutproof::Setup&, State&)>;

// Six functions as a backend. Those that are not given do nothing.
class FakeBackend final : public Backend {
 public:
  explicit FakeBackend(std::array<StageFunction, 6> stages) : stages_(std::move(stages)) {}
  std::string name() const override { return "fake"; }
  bool can_run(Span span) const override { return only ? span == Span{*only, *only} : single_stages || span == Span{}; }
  void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
    setups_ = std::move(setups);
    states_ = std::move(states);
  }
  void run(Span span) override {
    if (!can_run(span)) throw std::invalid_argument("this backend was asked for what it cannot run");
    last_span = span;
    for (body = 0; body < states_.size(); ++body) {
      State& state = states_[body];
      if (state.frame >= setups_[body].frame_count()) continue;
      for (const Stage stage : kStages) {
        const auto& function = stages_[static_cast<std::size_t>(stage)];
        if (span.contains(stage) && function) function(setups_[body], state);
      }
      if (span.contains(Stage::skin)) ++state.frame;
    }
  }
  std::vector<State> snapshot() const override { return states_; }
  SpanReport report() const override { return {}; }

  cutproof::Precision precision() const override { return arithmetic; }

  cutproof::Precision arithmetic = cutproof::Precision::binary64;
  bool single_stages = true;
  std::optional<Stage> only;  // the one stage that it can run
  Span last_span;             // for faults that depend on how they are called
  std::size_t body = 0;       // which one is being run

 private:
  std::array<StageFunction, 6> stages_;
  std::vector<cutproof::Setup> setups_;
  std::vector<State> states_;
};

FakeBackend fake_stage(Stage stage, StageFunction function) {
  std::array<StageFunction, 6> stages;
  stages[static_cast<std::size_t>(stage)] = std::move(function);
  return FakeBackend(std::move(stages));
}

FakeBackend fake_step(StageFunction step) { return fake_stage(Stage::step, std::move(step)); }

// Every particle moves on freely: no solver at all.
void coast(const cutproof::Setup& setup, State& state) {
  const double dt = setup.substep_length[static_cast<std::size_t>(state.frame)];
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (!state.alive[i]) continue;
      state.v[i] += dt * setup.step.gravity;
      state.x[i] += dt * state.v[i];
    }
  }
}

struct Scene {
  cutproof::Setup setup;
  State state;
};

// A block that is stretched and spins, over a floor.
Scene spinning_block(Solver solver = Solver::implicit, int64_t frames = 3) {
  Scene scene{setup_of(block_body(6, 5, 4, 0.25, 0.5), frames), {}};
  scene.setup.step.solver = solver;
  scene.setup.step.gravity = {0.5, -1, -9.81};
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = 0.2, .friction = 0}};
  scene.state = state_of(scene.setup.body, box_clusters(6, 5, 4, 3));
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
    Vec3& x = scene.state.x[i];
    scene.state.v[i] = {-2 * x.y, 2 * x.x, 3 * x.x};
    x.z *= 1.125;
  }
  return scene;
}

// A geometric plane cut through a block: the blade sweeps z down through x = 3.5 spacings.
Scene cut_block(Criterion criterion, int64_t frames = 4) {
  Scene scene{setup_of(block_body(6, 4, 4, 0.25, 0.5), frames), {}};
  scene.setup.detect.criterion = criterion;
  scene.setup.has_blade = true;
  scene.setup.blade = {.length = 3, .depth = 3, .thickness = 0.03, .friction = 0};
  const double top = 1.53, step = 0.31;
  for (int64_t s = 0; s < frames * scene.setup.step.substeps; ++s) {
    const auto pose = [&](int64_t at) {
      return BladePose{{0.8871, 0.613, top - step / 4 * static_cast<double>(at)}, {0, 1, 0}, {0, 0, 1}};
    };
    scene.setup.blade_moves.push_back({pose(s), pose(s + 1), true, 0});
  }
  scene.state = state_of(scene.setup.body, box_clusters(6, 4, 4, 2), 10, 60);
  scene.state.edge_covered = true;
  return scene;
}

// Two blocks that do not touch.
Scene two_blocks() {
  std::vector<Node> nodes;
  for (int32_t k = 0; k < 3; ++k) {
    for (int32_t j = 0; j < 3; ++j) {
      for (int32_t i = 0; i < 7; ++i) {
        if (i != 3) nodes.push_back({i, j, k});
      }
    }
  }
  Scene scene{setup_of(body_of(nodes), 3), {}};
  std::vector<std::vector<int32_t>> lists(2);
  for (int32_t i = 0; i < scene.setup.body.particle_count(); ++i) {
    const bool right = scene.setup.body.grid.coordinates(scene.setup.body.node[static_cast<std::size_t>(i)])[0] > 4;
    lists[right].push_back(i);
  }
  scene.state = state_of(scene.setup.body, lists);
  for (Vec3& v : scene.state.v) v = {1, 2, 3};
  scene.setup.step.gravity = {0, 0, -9.81};
  return scene;
}

bool mentions(const Verdict& verdict, const std::string& text) {
  return verdict.witness.text.find(text) != std::string::npos;
}

void expect_holds(const Verdict& verdict) {
  EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  EXPECT_GT(verdict.checked, 0) << verdict.property;
  EXPECT_LE(verdict.measured, verdict.bound) << verdict.property;
}

// --- Who is right passes ---------------------------------------------------------------------------------------------

TEST(Relations, TheReferenceIsDeterministicAndComposesFromSpans) {
  const auto backend = reference::make_backend();
  for (const Scene& scene : {spinning_block(), spinning_block(Solver::published), cut_block(Criterion::geometric),
                             cut_block(Criterion::distance)}) {
    expect_holds(determinism(*backend, scene.setup, scene.state, scene.setup.frame_count()));
    const Verdict composed = span_composition(*backend, scene.setup, scene.state, scene.setup.frame_count());
    expect_holds(composed);
    EXPECT_EQ(composed.checked, 6 * scene.setup.frame_count()) << "six ways to divide a frame";
    EXPECT_EQ(composed.backend, "reference");
  }
}

TEST(Relations, TheReferenceHasNoGhostForce) {
  const auto backend = reference::make_backend();
  const Scene scene = two_blocks();
  const Verdict verdict = no_ghost_force(*backend, scene.setup, scene.state, 0, {3, -2, 1}, 3);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 27);
}

TEST(Relations, TheReferenceKeepsRestAndTranslations) {
  const auto backend = reference::make_backend();
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const int32_t iterations : {0, 1, 4, 50}) {
      Scene scene = spinning_block(solver);
      scene.setup.step.iterations = iterations;
      expect_holds(rest_is_fixed(*backend, scene.setup, scene.state));
      const Verdict moved = translation_is_exact(*backend, scene.setup, scene.state, {3, -1, 2});
      expect_holds(moved);
      EXPECT_LT(moved.bound, 1e-8) << "the bound must be able to reject";
    }
  }
  // Wires, single particles and coincident clusters too.
  Scene wire{setup_of(block_body(7, 1, 1)), {}};
  wire.state = state_of(wire.setup.body, {{0, 1, 2}, {2, 3, 4}, {3}, {4, 5, 6}});
  expect_holds(rest_is_fixed(*backend, wire.setup, wire.state));
  expect_holds(translation_is_exact(*backend, wire.setup, wire.state, {0, 5, 0}));
}

TEST(Relations, TheReferencesEnergyNeverGrows) {
  const auto backend = reference::make_backend();
  for (const double stiffness : {1e3, 1e5, 1e7}) {
    Scene scene = spinning_block();
    scene.setup.step.stiffness = stiffness;
    const Verdict verdict = energy_is_monotone(*backend, scene.setup, scene.state, 40);
    expect_holds(verdict);
    EXPECT_EQ(verdict.checked, 40);
    Scene cut = cut_block(Criterion::distance);
    cut.setup.step.stiffness = stiffness;
    State state = cut.state;
    for (int64_t frame = 0; frame < 2; ++frame) {
      state.frame = frame;
      expect_holds(energy_is_monotone(*backend, cut.setup, state, 40));
    }
  }
  Scene rubbing = spinning_block();
  rubbing.setup.walls[0].friction = 0.5;
  EXPECT_EQ(energy_is_monotone(*backend, rubbing.setup, rubbing.state, 4).checked, 0) << "friction has no energy";
}

TEST(Relations, TheReferenceIsEquivariant) {
  const auto backend = reference::make_backend();
  const std::array<Span, 3> spans = {Span{}, Span{Stage::step, Stage::step}, Span{Stage::detect, Stage::skin}};
  std::array<int, kEquivarianceKinds> judged{};
  Scene one_end = cut_block(Criterion::distance);
  one_end.setup.detect.remove = RemovedEnds::one;
  Scene nearer_end = one_end;
  nearer_end.setup.detect.remove = RemovedEnds::nearer;
  // Another crossing in each direction and at each particle: a turn that took them for each other would show.
  Scene fitted = cut_block(Criterion::geometric);
  Body& body = fitted.setup.body;
  body.surface_crossing.resize(6 * body.node.size());
  for (std::size_t k = 0; k < body.surface_crossing.size(); ++k) {
    const bool leaves = body.neighbour(static_cast<int32_t>(k / 6), static_cast<int>(k % 6)) < 0;
    body.surface_crossing[k] = leaves ? static_cast<uint8_t>(kLeastCrossing + 37 * k % 225) : uint8_t{0};
  }
  for (const Scene& scene : {spinning_block(), cut_block(Criterion::geometric), cut_block(Criterion::distance), one_end,
                             nearer_end, fitted}) {
    // From the beginning, and from the middle of the run with a skin, dead particles and split clusters.
    backend->load({scene.setup}, {scene.state});
    backend->run(Span{});
    backend->run(Span{});
    const State later = backend->snapshot()[0];
    for (const State& state : {scene.state, later}) {
      for (uint64_t seed = 0; seed < 24; ++seed) {
        const Span span = spans[(seed / kEquivarianceKinds) % spans.size()];
        const Verdict verdict = equivariance(*backend, scene.setup, state, span, seed);
        EXPECT_TRUE(verdict.holds) << "seed " << seed << ": " << verdict.witness.text;
        EXPECT_LE(verdict.measured, verdict.bound) << "seed " << seed;
        judged[seed % kEquivarianceKinds] += verdict.checked > 0;
      }
    }
  }
  for (const int count : judged) EXPECT_GT(count, 12) << "of 24 runs of each kind most must be decided";
}

// A block that is pulled apart in the middle, with no blade to choose: of each edge the lower end goes, and which one
// that is hangs on the order of particles, which a turned scene has another of.
TEST(Relations, EquivarianceLeavesOutTurnsWhereTheOrderOfParticlesDecides) {
  const auto backend = reference::make_backend();
  Scene torn = cut_block(Criterion::distance);
  torn.setup.detect.remove = RemovedEnds::one;
  torn.setup.detect.without_blade = true;
  torn.setup.has_blade = false;
  torn.setup.blade_moves.clear();
  torn.setup.stroke_end.clear();
  const Body& body = torn.setup.body;
  double low = 1e300, high = -1e300;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    low = std::min(low, body.rest_position(i).x);
    high = std::max(high, body.rest_position(i).x);
  }
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    if (body.rest_position(i).x > (low + high) / 2) torn.state.x[at(i)].x += body.grid.spacing;
  }
  const Span span{Stage::detect, Stage::skin};
  backend->load({torn.setup}, {torn.state});
  backend->run(span);
  EXPECT_FALSE(backend->snapshot()[0].removed.empty());
  int checked = 0;
  for (uint64_t seed = 0; seed < 10 * kEquivarianceKinds; ++seed) {
    const Verdict verdict = equivariance(*backend, torn.setup, torn.state, span, seed);
    EXPECT_TRUE(verdict.holds) << "seed " << seed << ": " << verdict.witness.text;
    checked += verdict.checked > 0;
  }
  EXPECT_GT(checked, 40);
}

TEST(Relations, MoreStrokesOnlyRefineTheReferencesComponents) {
  const auto backend = reference::make_backend();
  Scene scene = cut_block(Criterion::geometric, 6);
  for (const int64_t fewer : {1, 3, 5}) {
    expect_holds(refinement(*backend, scene.setup, scene.state, fewer));
  }
  backend->load({scene.setup}, {scene.state});
  for (int frame = 0; frame < 6; ++frame) backend->run(Span{});
  EXPECT_EQ(graph_components(scene.setup, backend->snapshot()[0]).count, 2) << "the cut must be complete";
}

TEST(Relations, ABackendThatLeavesEverythingAsItIsPassesWhatItMust) {
  FakeBackend still = fake_step({});
  const Scene scene = two_blocks();
  expect_holds(determinism(still, scene.setup, scene.state, 2));
  expect_holds(span_composition(still, scene.setup, scene.state, 2));
  expect_holds(no_ghost_force(still, scene.setup, scene.state, 0, {1, 1, 1}, 2));
  expect_holds(rest_is_fixed(still, scene.setup, scene.state));
  expect_holds(refinement(still, scene.setup, scene.state, 1));
  for (uint64_t seed = 0; seed < 12; ++seed) expect_holds(equivariance(still, scene.setup, scene.state, Span{}, seed));
  const Verdict stays = translation_is_exact(still, scene.setup, scene.state, {1, 0, 0});
  EXPECT_FALSE(stays.holds) << "it does not move on";
  EXPECT_TRUE(mentions(stays, "in a second run of one substep, in which the body is thrown")) << stays.witness.text;
  FakeBackend coasting = fake_step(coast);
  expect_holds(translation_is_exact(coasting, scene.setup, scene.state, {1, 0, 0}));
}

TEST(Relations, WorkWithBackendsThatRunOnlyWholeFrames) {
  FakeBackend backend = fake_step(coast);
  backend.single_stages = false;
  const Scene scene = two_blocks();
  const Verdict composition = span_composition(backend, scene.setup, scene.state, 2);
  EXPECT_TRUE(composition.holds);
  EXPECT_EQ(composition.checked, 0);
  EXPECT_EQ(composition.vacuous, "the backend runs whole frames only");
  const Verdict step = equivariance(backend, scene.setup, scene.state, {Stage::step, Stage::step}, 1);
  EXPECT_TRUE(step.holds);
  EXPECT_EQ(step.vacuous, "the backend cannot run step by itself");
  expect_holds(translation_is_exact(backend, scene.setup, scene.state, {1, 0, 0}));
  for (uint64_t seed = 0; seed < 6; ++seed) expect_holds(equivariance(backend, scene.setup, scene.state, Span{}, seed));
}

TEST(Relations, SayWhatABackendOfOneStageCannotBeAskedFor) {
  FakeBackend backend = fake_stage(Stage::split, {});
  backend.only = Stage::split;
  const Scene scene = two_blocks();
  for (const Verdict& verdict :
       {determinism(backend, scene.setup, scene.state, 2), span_composition(backend, scene.setup, scene.state, 2),
        no_ghost_force(backend, scene.setup, scene.state, 0, {1, 1, 1}, 2),
        refinement(backend, scene.setup, scene.state, 1), rest_is_fixed(backend, scene.setup, scene.state),
        translation_is_exact(backend, scene.setup, scene.state, {1, 0, 0}),
        energy_is_monotone(backend, scene.setup, scene.state, 3),
        equivariance(backend, scene.setup, scene.state, Span{}, 0)}) {
    EXPECT_TRUE(verdict.holds) << verdict.property;
    EXPECT_EQ(verdict.checked, 0) << verdict.property;
    EXPECT_EQ(verdict.vacuous, "the backend cannot run step to skin") << verdict.property;
  }
  for (uint64_t seed = 0; seed < 6; ++seed) {
    expect_holds(equivariance(backend, scene.setup, scene.state, {Stage::split, Stage::split}, seed));
  }
}

TEST(Relations, VerdictsThatCheckedNothingSayWhy) {
  const auto backend = reference::make_backend();
  Scene scene = spinning_block();
  EXPECT_EQ(determinism(*backend, scene.setup, scene.state, 0).vacuous, "no frame was run");
  EXPECT_EQ(energy_is_monotone(*backend, scene.setup, scene.state, 0).vacuous, "no iteration was run");
  EXPECT_EQ(no_ghost_force(*backend, scene.setup, scene.state, 0, {1, 0, 0}, 1).vacuous, "no other component is alive");
  scene.setup.walls[0].friction = 0.5;
  EXPECT_EQ(energy_is_monotone(*backend, scene.setup, scene.state, 3).vacuous, "friction has no energy");
  scene.setup.step.solver = Solver::published;
  EXPECT_EQ(energy_is_monotone(*backend, scene.setup, scene.state, 3).vacuous,
            "only the implicit solver has an energy");
}

// A backend may answer anything.
TEST(Relations, AnswersThatAreNotWellFormedAreNotRead) {
  FakeBackend broken = fake_step([](const cutproof::Setup&, State& state) { state.skin.owner = {1000}; });
  const Scene scene = two_blocks();
  for (const uint64_t seed : {0, 1, 2, 3}) {
    const Verdict verdict = equivariance(broken, scene.setup, scene.state, Span{}, seed);
    EXPECT_FALSE(verdict.holds);
    EXPECT_TRUE(mentions(verdict, "not well formed")) << verdict.witness.text;
  }
}

// --- Who is wrong does not
// --------------------------------------------------------------------------------------------

TEST(NoGhostForce, RejectsASolverThatSubtractsTheGlobalMean) {
  FakeBackend ghost = fake_step([](const cutproof::Setup& setup, State& state) {
    coast(setup, state);
    Vec3 mean;
    for (const Vec3 x : state.x) mean += x / static_cast<double>(state.x.size());
    for (Vec3& x : state.x) x += 1e-12 * mean;
  });
  const Scene scene = two_blocks();
  const Verdict verdict = no_ghost_force(ghost, scene.setup, scene.state, 4, {0.5, 0, 0}, 1);
  EXPECT_FALSE(verdict.holds);
  ASSERT_EQ(verdict.witness.particles.size(), 2u);
  EXPECT_EQ(verdict.witness.particles[0], 4);
  const Partition parts = graph_components(scene.setup, scene.state);
  EXPECT_NE(parts.label[static_cast<std::size_t>(verdict.witness.particles[1])], parts.label[4]);
  EXPECT_EQ(verdict.measured, 27) << "every particle of the other block felt it";
}

// A block, and two particles beside it that are fewer than debris has to be. The block is held at one side, so that a
// kick tears it.
Scene held_block_and_crumb() {
  std::vector<Node> nodes = {{6, 1, 1}, {6, 1, 2}};
  for (int32_t k = 0; k < 3; ++k) {
    for (int32_t j = 0; j < 3; ++j) {
      for (int32_t i = 0; i < 4; ++i) nodes.push_back({i, j, k});
    }
  }
  Scene scene{setup_of(body_of(nodes), 3), {}};
  std::vector<std::vector<int32_t>> lists(2);
  Grip grip{{}, std::vector<uint8_t>(12, 1), std::vector<Vec3>(12)};
  for (int32_t i = 0; i < scene.setup.body.particle_count(); ++i) {
    const auto x = scene.setup.body.grid.coordinates(scene.setup.body.node[static_cast<std::size_t>(i)])[0];
    lists[x > 5].push_back(i);
    if (x == 1) grip.particles.push_back(i);
  }
  scene.state = state_of(scene.setup.body, lists);
  scene.setup.detect.without_blade = true;
  scene.setup.split.debris = 8;
  scene.setup.grips = {grip};
  return scene;
}
constexpr Vec3 kTearing = {3, 0, 0};  // [h] and in a substep

// The crumb goes in the one run, as it must: something was removed.
TEST(NoGhostForce, IsNotWhatACutElsewhereTakesAwayAsDebris) {
  const auto backend = reference::make_backend();
  const Scene scene = held_block_and_crumb();
  State kicked = scene.state;
  const Partition parts = graph_components(scene.setup, scene.state);
  for (std::size_t i = 0; i < kicked.x.size(); ++i) {
    if (parts.label[i] != parts.label[0]) continue;
    kicked.x[i] += kTearing;
    kicked.v[i] += kTearing / 0.004;
  }
  const auto after_a_frame = [&](const State& state) {
    backend->load({scene.setup}, {state});
    backend->run(Span{});
    return backend->snapshot().at(0);
  };
  EXPECT_TRUE(after_a_frame(scene.state).removed.empty());
  EXPECT_FALSE(after_a_frame(kicked).removed.empty());
  EXPECT_EQ(after_a_frame(kicked).debris.size(), 2u) << "or this test is about nothing";

  const Verdict verdict = no_ghost_force(*backend, scene.setup, scene.state, 0, kTearing, 1);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 2);
}

TEST(NoGhostForce, IsFoundInACrumb) {
  const Scene scene = held_block_and_crumb();
  FakeBackend pulling({[](const cutproof::Setup& setup, State& state) {
                         reference::step(setup, state);
                         for (std::size_t i = 0; i < state.x.size(); ++i) {
                           if (state.x[i].x > 5) state.x[i].y += 1e-15 * state.x[0].x;
                         }
                       },
                       reference::detect,
                       reference::split,
                       {},
                       {},
                       {}});
  const Verdict verdict = no_ghost_force(pulling, scene.setup, scene.state, 0, kTearing, 1);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.measured, 2);
  EXPECT_TRUE(mentions(verdict, "m elsewhere")) << verdict.witness.text;
}

TEST(NoGhostForce, SaysWhatBecameOfWhoFeltIt) {
  const Scene scene = two_blocks();
  const Partition parts = graph_components(scene.setup, scene.state);
  const auto last = parts.label.size() - 1;
  ASSERT_NE(parts.label[last], parts.label[0]);
  const auto witness_if = [&](const std::function<void(State&)>& ghost) {
    FakeBackend backend = fake_step([&](const cutproof::Setup&, State& state) {
      if (state.v[0].x > 1) ghost(state);  // kicked
    });
    return no_ghost_force(backend, scene.setup, scene.state, 0, {1, 0, 0}, 1).witness.text;
  };
  const std::string removed = witness_if([&](State& state) { state.alive[last] = 0; });
  EXPECT_NE(removed.find(" is removed in one run only because the component of particle 0"), std::string::npos)
      << removed;
  const std::string faster = witness_if([&](State& state) { state.v[last].y += 0.5; });
  EXPECT_NE(faster.find(" ends 0.5 m/s faster or slower because"), std::string::npos) << faster;
  const std::string elsewhere = witness_if([&](State& state) { state.x[last].y += 0.5; });
  EXPECT_NE(elsewhere.find(" ends 0.5 m elsewhere because"), std::string::npos) << elsewhere;
}

TEST(Determinism, RejectsABackendThatRemembers) {
  int calls = 0;
  FakeBackend moody = fake_step([&calls](const cutproof::Setup&, State& state) {
    if (++calls == 5) state.v[11].y = std::nextafter(state.v[11].y, 9.0);
  });
  const Scene scene = two_blocks();
  const Verdict verdict = determinism(moody, scene.setup, scene.state, 3);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "velocity of particle 11")) << verdict.witness.text;
  EXPECT_TRUE(mentions(verdict, "frame 1")) << verdict.witness.text;
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{11});
}

TEST(Determinism, TellsZeroFromMinusZeroAndSeesNoDifferenceInEqualNaNs) {
  int calls = 0;
  FakeBackend signs =
      fake_step([&calls](const cutproof::Setup&, State& state) { state.x[0].x = ++calls == 1 ? 0.0 : -0.0; });
  const Scene scene = two_blocks();
  EXPECT_FALSE(determinism(signs, scene.setup, scene.state, 1).holds);
  FakeBackend nan = fake_step([](const cutproof::Setup&, State& state) { state.x[0].x = std::nan(""); });
  EXPECT_TRUE(determinism(nan, scene.setup, scene.state, 1).holds) << "that is for the oracle `finite` to say";
}

TEST(SpanComposition, RejectsAFusedFrameThatDiffersFromItsStages) {
  FakeBackend* self = nullptr;
  FakeBackend fused = fake_stage(Stage::detect, [&self](const cutproof::Setup&, State& state) {
    if (self->last_span == Span{Stage::step, Stage::detect}) state.removed.push_back(3);
  });
  self = &fused;
  const Scene scene = two_blocks();
  const Verdict verdict = span_composition(fused, scene.setup, scene.state, 2);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "step-detect split-skin: the list of removed particles differs"))
      << verdict.witness.text;
}

TEST(RestIsFixed, RejectsABackendThatDrifts) {
  FakeBackend drifting = fake_step([](const cutproof::Setup&, State& state) { state.x[20].z += 1e-8; });
  const Scene scene = two_blocks();
  const Verdict verdict = rest_is_fixed(drifting, scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{20});
  EXPECT_NEAR(verdict.measured, 1e-8, 1e-12);
  FakeBackend broken = fake_step([](const cutproof::Setup&, State& state) { state.x[20].z = std::nan(""); });
  EXPECT_FALSE(rest_is_fixed(broken, scene.setup, scene.state).holds);
}

// The rest frame of a cluster whose neighbour was merged, left as it was (method.md §5), in a solver that trusts it.
TEST(RestIsFixed, RejectsAStaleRestFrame) {
  FakeBackend trusting = fake_step([](const cutproof::Setup& setup, State& state) {
    const Clusters& clusters = state.clusters;
    std::vector<double> memberships(state.x.size(), 0);
    for (const int32_t i : clusters.members) memberships[static_cast<std::size_t>(i)] += 1;
    std::vector<Vec3> next(state.x.size());
    for (int32_t c = 0; c < clusters.count(); ++c) {
      const auto at_c = static_cast<std::size_t>(c);
      Vec3 center;
      for (const int32_t i : clusters.of(c)) {
        const auto at_i = static_cast<std::size_t>(i);
        center += setup.body.mass[at_i] / memberships[at_i] / clusters.mass[at_c] * state.x[at_i];
      }
      for (const int32_t i : clusters.of(c)) {
        const auto at_i = static_cast<std::size_t>(i);
        next[at_i] += (center + setup.body.rest_position(i) - clusters.rest_center[at_c]) / memberships[at_i];
      }
    }
    state.x = next;
  });
  Scene scene = spinning_block();
  expect_holds(rest_is_fixed(trusting, scene.setup, scene.state));
  scene.state.clusters.rest_center[2].x += 1e-6;
  const Verdict verdict = rest_is_fixed(trusting, scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  const auto members = scene.state.clusters.of(2);
  EXPECT_TRUE(std::find(members.begin(), members.end(), verdict.witness.particles.at(0)) != members.end());
}

TEST(TranslationIsExact, RejectsABackendThatDampsInSecret) {
  FakeBackend damped = fake_step([](const cutproof::Setup& setup, State& state) {
    for (Vec3& v : state.v) v = 0.999999 * v;
    coast(setup, state);
  });
  const Scene scene = two_blocks();
  const Verdict verdict = translation_is_exact(damped, scene.setup, scene.state, {1, 0, 0});
  EXPECT_FALSE(verdict.holds);
  EXPECT_FALSE(verdict.witness.particles.empty());
}

// In single precision as well, bounds are what rounding does there and not a multiple of h.
TEST(RestIsFixed, SeesSmallFaultsOfSinglePrecision) {
  const Scene scene = two_blocks();
  const double h = scene.setup.body.grid.spacing;
  for (const double size : {0.0, 3e-5}) {
    FakeBackend thrown = fake_step([&](const cutproof::Setup& setup, State& state) {
      reference::step(setup, state);
      state.x[20].z += size * h;
      round_to_single(setup.body, state);
    });
    thrown.arithmetic = cutproof::Precision::binary32;
    EXPECT_EQ(rest_is_fixed(thrown, scene.setup, scene.state).holds, size == 0);
    EXPECT_EQ(translation_is_exact(thrown, scene.setup, scene.state, {1, 0, 0}).holds, size == 0);
  }
}

TEST(EnergyIsMonotone, SeesSmallGrowthInSinglePrecision) {
  const Scene scene = spinning_block();
  for (const double size : {0.0, 1e-4}) {
    FakeBackend restless = fake_step([&](const cutproof::Setup& setup, State& state) {
      const int32_t iterations = setup.step.iterations;
      reference::step(setup, state);
      if (iterations == 6) {
        for (std::size_t i = 0; i < state.x.size(); ++i) {
          state.x[i].z += (i % 2 == 0 ? size : -size) * setup.body.grid.spacing;
        }
      }
      round_to_single(setup.body, state);
    });
    restless.arithmetic = cutproof::Precision::binary32;
    const Verdict verdict = energy_is_monotone(restless, scene.setup, scene.state, 6);
    EXPECT_EQ(verdict.holds, size == 0) << verdict.witness.text << ' ' << verdict.measured << ' ' << verdict.bound;
  }
}

TEST(Refinement, RejectsABackendThatHealsWhatWasCut) {
  // Removes the middle layer in frame 0, and gives it back in frame 2.
  FakeBackend healing = fake_stage(Stage::detect, [](const cutproof::Setup& setup, State& state) {
    for (std::size_t i = 0; i < state.alive.size(); ++i) {
      if (setup.body.grid.coordinates(setup.body.node[i])[0] == 3) {
        state.alive[i] = state.frame != 0 && state.frame != 1;
      }
    }
  });
  Scene scene{setup_of(block_body(5, 2, 2), 3), {}};
  scene.state = state_of(scene.setup.body, {});
  const Verdict revived = refinement(healing, scene.setup, scene.state, 1);
  EXPECT_FALSE(revived.holds);
  EXPECT_TRUE(mentions(revived, "dead after fewer strokes"));
  EXPECT_EQ(scene.setup.body.grid.coordinates(
                scene.setup.body.node[static_cast<std::size_t>(revived.witness.particles.at(0))])[0],
            3);
  // Fewer strokes cut, more do not: separate particles are joined by nothing but alive ones.
  FakeBackend forgetful = fake_stage(Stage::detect, [](const cutproof::Setup& setup, State& state) {
    for (std::size_t i = 0; i < state.alive.size(); ++i) {
      if (setup.body.grid.coordinates(setup.body.node[i])[0] == 3) {
        state.alive[i] = setup.frame_count() == 3;
      }
    }
  });
  EXPECT_FALSE(refinement(forgetful, scene.setup, scene.state, 2).holds);
}

TEST(EnergyIsMonotone, RejectsIterationsThatOvershoot) {
  // After the second iteration each particle is pushed a bit away from the best place.
  FakeBackend restless = fake_step([](const cutproof::Setup& setup, State& state) {
    const int32_t iterations = setup.step.iterations;
    reference::step(setup, state);
    if (iterations == 3) {
      for (std::size_t i = 0; i < state.x.size(); ++i) state.x[i].z += (i % 2 == 0 ? 1e-2 : -1e-2);
    }
  });
  const Scene scene = spinning_block();
  const Verdict verdict = energy_is_monotone(restless, scene.setup, scene.state, 6);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "iteration 3 raises the energy")) << verdict.witness.text;
  EXPECT_GT(verdict.measured, verdict.bound);
}

// Each kind of equivariance rejects a fault that only it can see.
TEST(Equivariance, EachKindRejectsItsFault) {
  struct Fault {
    uint64_t kind;
    const char* what;
    StageFunction step;
    const char* text;
  };
  FakeBackend* self = nullptr;
  const std::vector<Fault> faults = {
      {0, "the x axis is special",
       [](const cutproof::Setup&, State& s) {
         s.v[0] += Vec3{1e-6, 0, 0};
       },
       "turned"},
      {1, "absolute positions enter",
       [](const cutproof::Setup&, State& s) {
         for (Vec3& x : s.x) x += 1e-9 * x;
       },
       "shifted by"},
      {2, "the first cluster is special",
       [](const cutproof::Setup&, State& s) {
         for (const int32_t i : s.clusters.of(0)) s.x[static_cast<std::size_t>(i)].x += 1e-6;
       },
       "clusters in another order"},
      {3, "a length that is not scaled", [](const cutproof::Setup&, State& s) { s.x[5].y += 1e-9; }, "scaled by"},
      {4, "the world's origin enters",
       [](const cutproof::Setup& setup, State& s) { s.x[5].x += 1e-12 * setup.body.origin.x; }, "elsewhere"},
      {5, "the second body is treated differently",
       [&self](const cutproof::Setup&, State& s) { s.v[2].z += static_cast<double>(self->body); }, "body 1 of two"},
  };
  Scene scene = spinning_block();
  scene.state.v[0] = {};
  for (const Fault& fault : faults) {
    FakeBackend backend = fake_step(fault.step);
    self = &backend;
    int rejected = 0;
    for (uint64_t round = 1; round < 7; ++round) {
      const uint64_t seed = fault.kind + kEquivarianceKinds * round;
      const Verdict verdict = equivariance(backend, scene.setup, scene.state, Span{}, seed);
      rejected += !verdict.holds;
      EXPECT_TRUE(verdict.holds || mentions(verdict, fault.text)) << verdict.witness.text;
    }
    // A turn may keep the x axis, a new order the first cluster.
    EXPECT_GE(rejected, 4) << fault.what;
  }
}

TEST(Equivariance, RejectsDecisionsThatDependOnTheGrid) {
  // Removes particles by the parity of their node.
  FakeBackend checkered = fake_stage(Stage::detect, [](const cutproof::Setup& setup, State& state) {
    for (std::size_t i = 0; i < state.alive.size(); ++i) {
      if (setup.body.node[i] % 5 == 0) state.alive[i] = 0;
    }
  });
  const Scene scene = spinning_block();
  int rejected = 0;
  for (uint64_t round = 0; round < 5; ++round) {
    const Verdict verdict = equivariance(checkered, scene.setup, scene.state, Span{}, 1 + kEquivarianceKinds * round);
    rejected += !verdict.holds;
    if (!verdict.holds) {
      EXPECT_TRUE(mentions(verdict, "in the other run")) << verdict.witness.text;
      EXPECT_EQ(verdict.witness.particles.size(), 1u);
    }
  }
  EXPECT_GE(rejected, 3) << "a shift by a multiple of five nodes hides it";
}

TEST(Equivariance, RejectsASplitThatDependsOnTheOrderOfClusters) {
  // Drops the last cluster's last member.
  FakeBackend losing = fake_stage(Stage::split, [](const cutproof::Setup&, State& state) {
    state.clusters.members.pop_back();
    --state.clusters.offsets.back();
  });
  const Scene scene = spinning_block();
  const Verdict verdict = equivariance(losing, scene.setup, scene.state, Span{Stage::split, Stage::split}, 2);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "after split: the clusters differ")) << verdict.witness.text;
}

TEST(Equivariance, RejectsAMergeThatIsNotLegalInOneOfTheRuns) {
  // Merges the first two clusters, whether they touch or not.
  FakeBackend greedy = fake_stage(Stage::merge, [](const cutproof::Setup& setup, State& state) {
    auto lists = tests::lists_of(state.clusters);
    lists[0].insert(lists[0].end(), lists[1].begin(), lists[1].end());
    std::sort(lists[0].begin(), lists[0].end());
    lists[0].erase(std::unique(lists[0].begin(), lists[0].end()), lists[0].end());
    lists.erase(lists.begin() + 1);
    state.clusters = tests::clusters_of(setup.body, lists);
  });
  Scene scene{setup_of(block_body(12, 1, 1)), {}};
  scene.state = state_of(scene.setup.body, {{0, 1, 2}, {2, 3, 4, 5}, {5, 6, 7, 8}, {8, 9, 10, 11}}, 4, 8);
  int rejected = 0;
  for (uint64_t round = 0; round < 6; ++round) {
    const Verdict verdict = equivariance(greedy, scene.setup, scene.state, Span{Stage::merge, Stage::merge},
                                         2 + kEquivarianceKinds * round);
    rejected += !verdict.holds;
    EXPECT_TRUE(verdict.holds || mentions(verdict, "after merge")) << verdict.witness.text;
  }
  EXPECT_GT(rejected, 0);
}

// A decision exactly on the edge may fall either way; the verdict says that nothing was decided.
TEST(Equivariance, CallsARemovalInsideTheRoundingBandEither) {
  int runs = 0;
  // Two particles are exactly 1.5 h apart; which way rounding falls alternates from run to run. One disturbed upwards
  // or downwards is decided by the disturbance.
  FakeBackend edge = fake_stage(Stage::detect, [&runs](const cutproof::Setup& setup, State& state) {
    const double distance = norm(state.x[1] - state.x[0]) / setup.body.grid.spacing;
    const double margin = distance - setup.detect.epsilon;
    const bool removed = std::abs(margin) < 1e-12 ? ++runs % 2 == 0 : margin > 0;
    if (removed) {
      state.alive[0] = state.alive[1] = 0;
      state.removed = {0, 1};
    }
  });
  Scene scene{setup_of(block_body(2, 1, 1)), {}};
  scene.state = state_of(scene.setup.body, {});
  scene.state.x[1].x += 0.5;
  const Verdict verdict = equivariance(edge, scene.setup, scene.state, Span{Stage::detect, Stage::detect}, 1);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.checked, 0);
}

TEST(Relations, StatesThatAreNotWellFormedAreNotJudged) {
  const auto backend = reference::make_backend();
  Scene scene = spinning_block();
  scene.state.clusters.members[3] = 9999;
  for (const Verdict& verdict :
       {rest_is_fixed(*backend, scene.setup, scene.state), energy_is_monotone(*backend, scene.setup, scene.state, 3),
        equivariance(*backend, scene.setup, scene.state, Span{}, 0),
        no_ghost_force(*backend, scene.setup, scene.state, 0, {}, 1),
        translation_is_exact(*backend, scene.setup, scene.state, {}),
        refinement(*backend, scene.setup, scene.state, 1)}) {
    EXPECT_FALSE(verdict.holds) << verdict.property;
    EXPECT_TRUE(mentions(verdict, "could not be judged")) << verdict.property;
  }
}

}  // namespace
}  // namespace cutproof::oracles::relations_test
