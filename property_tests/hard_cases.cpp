// The hard cases of architecture.md, Hard cases, each with the behaviour that is expected of every backend. After every
// stage every oracle is asked, and every stage is compared with the reference's from the same state (judge_case).
// Particle counts around the sizes of warps and blocks: properties.cpp, DissectsBodiesOfSizesAroundThoseOfBlocks.
// Rotations have hard cases of their own: fixtures/hard_matrices.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <stdexcept>

#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "model/rules.h"
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/surface/surface.h"
#include "property_tests/checking.h"
#include "property_tests/dissection.h"
#include "property_tests/random.h"

namespace cutproof::property_tests {
namespace {

using Nodes = std::vector<Node>;

Nodes block(int32_t nx, int32_t ny, int32_t nz) {
  return nodes_where({nx, ny, nz}, [](Node) { return true; });
}

// A blade of thickness 0 and without ends, so that a cut takes exactly the nodes within h/2 of its plane. h = 1 m: the
// distances are exact in single precision too.
Case with_thin_blade(Nodes nodes) {
  Case c;
  c.nodes = std::move(nodes);
  c.blade_thickness = 0;
  return c;
}

// The same of a body that moves.
Case moving(Nodes nodes, int32_t substeps, int32_t iterations, int32_t stiffness) {
  Case c = with_thin_blade(std::move(nodes));
  c.moves = true;
  c.substeps = substeps;
  c.iterations = iterations;
  c.stiffness = stiffness;
  return c;
}

// Through everything along the plane x = quarters / 4, or z.
constexpr int32_t kFar = 200;
Stroke through_x(int32_t quarters) { return {{quarters, -kFar, -8}, {quarters, kFar, -8}, 4, true, Link::apart}; }
Stroke through_z(int32_t quarters) { return {{-kFar, -8, quarters}, {kFar, -8, quarters}, 2, true, Link::apart}; }

int64_t alive_in(const State& state) { return std::count(state.alive.begin(), state.alive.end(), 1); }

void relax(StepParameters& step, double relaxation) {
  step.solver = Solver::published;
  step.relaxation = relaxation;
}

double determinant(const Mat3& r) {
  return dot({r(0, 0), r(0, 1), r(0, 2)}, cross({r(1, 0), r(1, 1), r(1, 2)}, {r(2, 0), r(2, 1), r(2, 2)}));
}

// By how much the length of an edge of the tissue differs from h at most [h].
double greatest_strain(const Setup& setup, const State& state) {
  const Body& body = setup.body;
  double most = 0;
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (int direction = 0; direction < 6; direction += 2) {
      const int32_t q = body.neighbour(p, direction);
      if (q < 0 || !state.alive[at(p)] || !state.alive[at(q)]) continue;
      const double length = norm(state.x[at(p)] - state.x[at(q)]);
      most = std::max(most, std::abs(length / body.grid.spacing - 1));
    }
  }
  return most;
}

// A case that has run to its end.
struct Outcome {
  Setup setup;
  CaseRun run;
  int64_t verdicts = 0;
  const State& last() const { return run.trace.moments.empty() ? *run.trace.initial : *run.trace.moments.back().after; }
  // After each run of `stage`.
  std::vector<const State*> after_every(Stage stage) const {
    std::vector<const State*> states;
    for (const harness::Moment& moment : run.trace.moments) {
      if (moment.span.last == stage) states.push_back(moment.after.get());
    }
    return states;
  }
  int64_t removed() const {
    int64_t count = 0;
    for (const State* state : after_every(Stage::detect)) count += static_cast<int64_t>(state->removed.size());
    return count;
  }
  int32_t components() const { return oracles::graph_components(setup, last()).count; }
};

class HardCases : public ::testing::TestWithParam<NamedBackend> {
 protected:
  // Every access of a simulated schedule is a decision: smaller bodies, fewer strokes.
  bool is_slow() const { return GetParam().most_size < 100; }

  // Runs the case to its end and asks every oracle; none may fail. `thorough`: with CGAL's checks of every skin.
  Outcome run(const Case& c, Instance loaded, bool thorough = true) {
    std::vector<Instance> all = {std::move(loaded)};
    Outcome outcome;
    outcome.run = std::move(run_cases(*backend_, all).front());
    outcome.setup = all.front().setup;
    const Judgement judgement = judge_case(c, all.front(), outcome.run, backend_->name(), thorough);
    outcome.verdicts = judgement.verdicts;
    EXPECT_FALSE(judgement.failure) << describe(*judgement.failure);
    EXPECT_GT(outcome.verdicts + (outcome.run.trace.moments.empty() ? 1 : 0), 0);
    return outcome;
  }
  Outcome run(const Case& c) { return run(c, instance_of(c)); }

  // A body that nothing cuts, for so many frames.
  Instance undisturbed(const Case& c, int64_t frames, double dt) const {
    Instance loaded = instance_of(c);
    without_blade(loaded.setup);
    loaded.setup.substep_length.assign(at(frames), dt);
    loaded.state = in_arithmetic_of(*backend_, std::move(loaded.state));
    return loaded;
  }

  const std::unique_ptr<Backend> backend_ = GetParam().make();
};

// --- Bodies ----------------------------------------------------------------------------------------------------------

TEST_P(HardCases, SheetsAndWiresOfOneNodeAreCutInTwo) {
  struct {
    Nodes nodes;
    int32_t plane;  // [quarters]
    int64_t removed;
  } const cases[] = {{block(9, 9, 1), 16, 9},
                     {block(9, 9, 1), 18, 18},
                     {block(9, 1, 9), 16, 9},
                     {block(12, 1, 1), 16, 1},
                     {block(12, 1, 1), 18, 2}};
  for (const auto& [nodes, plane, removed] : cases) {
    for (const int32_t side : {1, 3, 5}) {
      SCOPED_TRACE(testing::Message() << nodes.size() << " particles, plane " << plane << "/4, boxes of " << side);
      Case c = with_thin_blade(nodes);
      c.side = side;
      c.strokes = {through_x(plane)};
      const Outcome cut = run(c);
      EXPECT_EQ(cut.removed(), removed);
      EXPECT_EQ(cut.components(), 2);
    }
  }
  // Along a sheet: all of it goes.
  Case along = with_thin_blade(block(6, 6, 1));
  along.strokes = {through_z(0)};
  EXPECT_EQ(alive_in(run(along).last()), 0);
}

TEST_P(HardCases, ClustersOfOneTwoAndThreeParticlesStayCoupledWhereTissueIsConnected) {
  for (const int32_t most : {1, 2, 3}) {
    SCOPED_TRACE(testing::Message() << "clusters of at most " << most);
    Case c = with_thin_blade(block(5, 4, 4));
    c.clusters = ClusterKind::foreign;
    c.most = most;
    c.tau = 2;
    c.cap = 2 * most;
    c.strokes = {through_x(8), through_z(100)};  // the second misses
    const Instance loaded = instance_of(c);
    for (int32_t k = 0; k < loaded.state.clusters.count(); ++k) ASSERT_LE(loaded.state.clusters.size(k), most);
    const Outcome cut = run(c);
    EXPECT_EQ(cut.removed(), 16);
    EXPECT_EQ(cut.components(), 2);
    // Edge cover has run: coupled exactly where the tissue is connected, whatever the clusters were.
    EXPECT_TRUE(cut.last().edge_covered);
    EXPECT_EQ(oracles::coupling_components(cut.setup, cut.last()).count, 2);
  }
}

TEST_P(HardCases, BodiesOfNoAndOfOneParticleRunThroughEveryStage) {
  for (const bool moves : {false, true}) {
    Case c = with_thin_blade({});
    c.moves = moves;
    c.strokes = {through_x(0)};
    const Outcome nothing = run(c);
    EXPECT_EQ(nothing.removed(), 0);
    EXPECT_TRUE(nothing.last().skin.triangles.empty());
    EXPECT_EQ(nothing.last().frame, nothing.setup.frame_count());

    c.nodes = {{0, 0, 0}};
    c.strokes = {through_x(8)};
    const Outcome missed = run(c);
    EXPECT_EQ(alive_in(missed.last()), 1);
    EXPECT_EQ(missed.last().skin.triangles.size(), 8U) << "an octahedron";
    c.strokes = {through_x(0)};
    const Outcome hit = run(c);
    // Alone it has no neighbour, so a dynamic blade pushes it away and cuts nothing.
    EXPECT_EQ(alive_in(hit.last()), moves ? 1 : 0);
    EXPECT_EQ(hit.last().skin.triangles.size(), moves ? 8U : 0U);
    EXPECT_EQ(hit.last().clusters.count(), moves ? 1 : 0);
  }
}

TEST_P(HardCases, ABodyThatIsCutAwayEntirelyLeavesNothingAndLaterFramesRunOn) {
  for (const ClusterKind kind : {ClusterKind::boxes, ClusterKind::sampled, ClusterKind::foreign}) {
    Case c = with_thin_blade(block(4, 4, 4));
    c.clusters = kind;
    c.blade_thickness = 40;  // 10 h: thicker than the body
    c.strokes = {through_x(6), through_x(6), through_z(6)};
    const Outcome gone = run(c);
    EXPECT_EQ(gone.removed(), 64);
    EXPECT_EQ(alive_in(gone.last()), 0);
    EXPECT_EQ(gone.last().clusters.count(), 0);
    EXPECT_TRUE(gone.last().skin.triangles.empty());
    EXPECT_EQ(gone.last().frame, 3);
  }
}

// --- Cuts ------------------------------------------------------------------------------------------------------------

TEST_P(HardCases, CutsThroughVerticesAlongEdgesAndInPlanesOfTheGridTakeWhatLiesWithinHalfASpacing) {
  struct {
    const char* name;
    Stroke stroke;
    int32_t length, depth;  // of the blade [quarters]
    int64_t removed;
    int32_t components;
  } const cases[] = {
      // The plane x = y: its neighbours are 0.71 h away.
      {"through vertices", {{-40, -40, -8}, {80, 80, -8}, 4, true, Link::apart}, 400, 400, 25, 2},
      {"along one edge", {{4, 8, 8}, {8, 8, 8}, 4, true, Link::apart}, 1, 1, 2, 1},
      {"into one vertex", {{8, 8, 40}, {8, 8, 16}, 4, true, Link::apart}, 1, 400, 1, 1},
      {"coplanar with a plane of the grid", through_z(8), 400, 400, 25, 2},
      {"halfway between two planes", through_z(10), 400, 400, 50, 2},
      {"coplanar with the boundary", through_z(0), 400, 400, 25, 1},
      {"zero length, a plate that stands in the tissue",
       {{8, 8, -8}, {8, 8, -8}, 4, true, Link::apart},
       400,
       400,
       25,
       2},
      {"zero length, between the nodes", {{10, 10, 10}, {10, 10, 10}, 4, true, Link::apart}, 1, 1, 0, 1},
      {"beside the body", through_z(-3), 400, 400, 0, 1},
  };
  for (const auto& expected : cases) {
    SCOPED_TRACE(expected.name);
    Case c = with_thin_blade(block(5, 5, 5));
    c.blade_length = expected.length;
    c.blade_depth = expected.depth;
    c.strokes = {expected.stroke};
    const Outcome cut = run(c);
    EXPECT_EQ(cut.removed(), expected.removed);
    EXPECT_EQ(cut.components(), expected.components);
  }
}

TEST_P(HardCases, ARetracedCutTakesNothingMore) {
  for (const bool slanted : {false, true}) {
    Case c = with_thin_blade(block(6, 5, 5));
    Stroke back;
    back.link = Link::retraced;
    c.strokes = {slanted ? Stroke{{-8, -3, 13}, {33, 30, 5}, 4, true, Link::apart} : through_x(10), back, back};
    const Outcome cut = run(c);
    const auto detected = cut.after_every(Stage::detect);
    ASSERT_EQ(detected.size(), 3U);
    EXPECT_FALSE(detected[0]->removed.empty());
    EXPECT_TRUE(detected[1]->removed.empty());
    EXPECT_TRUE(detected[2]->removed.empty());
  }
}

TEST_P(HardCases, ABladeThinnerThanASpacingSeparatesInEveryPlane) {
  for (int32_t quarters = 4; quarters <= 12; ++quarters) {
    for (const int32_t thickness : {0, 1, 3}) {
      SCOPED_TRACE(testing::Message() << "plane " << quarters << "/4, thickness " << thickness << "/4");
      Case c = with_thin_blade(block(5, 4, 4));
      c.blade_thickness = thickness;
      c.strokes = {through_x(quarters)};
      const Outcome cut = run(c);
      EXPECT_EQ(cut.components(), 2);
      EXPECT_EQ(cut.removed(), quarters % 4 == 2 ? 32 : 16);
    }
  }
}

TEST_P(HardCases, ABladeThickerThanTheBodyPushesOrCutsAndKeepsEveryInvariant) {
  for (const int32_t thickness : {20, 100}) {
    Case c = moving(block(4, 4, 4), 2, 2, 5);
    c.blade_thickness = thickness;
    c.ground = true;
    // From above into the body and beyond.
    c.strokes = {{{6, 6, 4 * thickness}, {6, 6, -8}, 4, true, Link::apart}};
    const Outcome pressed = run(c);
    EXPECT_GT(pressed.removed(), 0);
    EXPECT_GT(alive_in(pressed.last()), 0);
    // Whatever is left has been moved out of the way.
    const double keep_off = 0.5 * c.blade_thickness * c.spacing / 4;
    const BladePose& at_last = pressed.setup.blade_moves.back().to;
    const Vec3 normal = cross(at_last.along, at_last.back);
    for (std::size_t p = 0; p < pressed.last().x.size(); ++p) {
      if (!pressed.last().alive[p]) continue;
      EXPECT_GE(std::abs(dot(pressed.last().x[p] - at_last.edge, normal)), keep_off) << "particle " << p;
    }
  }
}

TEST_P(HardCases, ABladeFasterThanASpacingInASubstepTunnelsThroughNothing) {
  constexpr double kSpacing = 0.01;
  for (const double speed : {5.0, 50.0}) {  // 2 h and 20 h in a substep of 4 ms
    SCOPED_TRACE(testing::Message() << speed << " m/s");
    Scene scene;
    Shape box;
    box.kind = Shape::Kind::box;
    box.size = {9 * kSpacing, 4 * kSpacing, 4 * kSpacing};
    scene.body.shape = box;
    scene.body.spacing = kSpacing;
    scene.step.damping = 5;
    GripSpec left, right;
    left.high = {0.15, 1, 1};
    right.low = {0.85, 0, 0};
    right.high = {1, 1, 1};
    scene.grips = {left, right};
    BladeSpec blade;
    blade.thickness = 0.5;
    blade.speed = speed;
    StrokeSpec stroke;
    stroke.points = {{0.5, 0.5, 1.2}, {0.5, 0.5, -0.2}};
    stroke.along = Vec3{0, 1, 0};
    blade.strokes = {stroke};
    scene.blade = blade;
    for (const RemovedEnds remove : {RemovedEnds::both, RemovedEnds::one, RemovedEnds::nearer}) {
      scene.detect.remove = remove;
      const fixtures::Built built = fixtures::build(scene, "hard_cases");
      ASSERT_EQ(built.setup.body.particle_count(), 9 * 4 * 4);
      for (const BladeMove& move : built.setup.blade_moves) {
        ASSERT_LE(norm(move.to.edge - move.from.edge), blade_clearance(built.setup) * (1 + 1e-12));
      }
      const Outcome cut = run(Case{}, {built.setup, built.state});
      EXPECT_GE(cut.removed(), remove == RemovedEnds::both ? 2 * 16 : 16)
          << name_of(remove) << ": ends of every edge that the plate crosses";
      // No way is left from one held end to the other.
      const oracles::Partition partition = oracles::graph_components(cut.setup, cut.last());
      EXPECT_NE(partition.label.front(), partition.label.back());
    }
  }
}

// --- States and parameters of the step -------------------------------------------------------------------------------

TEST_P(HardCases, InvertedAndFlattenedBodiesComeBackToTheirShape) {
  struct {
    const char* name;
    Vec3 factor;
  } const cases[] = {{"mirrored", {1, 1, -1}},           {"inverted", {-1, -1, -1}}, {"flattened", {1, 1, 0}},
                     {"nearly flattened", {1, 1, 1e-9}}, {"a line", {1, 0, 0}},      {"a point", {0, 0, 0}}};
  for (const auto& [name, factor] : cases) {
    for (const double volume_share : {0.0, 0.9}) {
      SCOPED_TRACE(testing::Message() << name << ", volume share " << volume_share);
      const Case c = moving(block(4, 4, 4), 2, 2, 6);  // one cluster: several may hold each other in a twisted minimum
      Instance loaded = undisturbed(c, 40, 0.004);
      ASSERT_EQ(loaded.state.clusters.count(), 1);
      loaded.setup.step.damping = 20;
      loaded.setup.step.volume_share = volume_share;
      const Vec3 center = loaded.state.clusters.rest_center.front();
      for (Vec3& x : loaded.state.x) {
        for (int axis = 0; axis < 3; ++axis) x[axis] = center[axis] + factor[axis] * (x[axis] - center[axis]);
      }
      const Outcome outcome = run(c, loaded, false);
      for (const harness::Moment& moment : outcome.run.trace.moments) {
        const State& state = *moment.after;
        ASSERT_TRUE(std::all_of(state.x.begin(), state.x.end(), is_finite));
      }
      EXPECT_LT(greatest_strain(outcome.setup, outcome.last()), 1e-2);
      EXPECT_NEAR(determinant(outcome.last().clusters.rotation.front()), 1, 1e-5) << "a rotation, never a reflection";
    }
  }
}

TEST_P(HardCases, SeveralInvertedClustersStayFiniteAndTheirRotationsRotations) {
  Case c = moving(block(6, 4, 4), 2, 2, 6);
  c.side = 3;
  for (const double factor : {-1.0, 0.0, 1e-9, 3.0}) {
    for (const double volume_share : {0.0, 0.9}) {
      SCOPED_TRACE(testing::Message() << factor << ", volume share " << volume_share);
      Instance loaded = undisturbed(c, 20, 0.004);
      ASSERT_GT(loaded.state.clusters.count(), 1);
      loaded.setup.step.volume_share = volume_share;
      for (Vec3& x : loaded.state.x) x.z = 2.5 + factor * (x.z - 2.5);
      run(c, loaded, false);  // finite, rotation, momentum: after every step
    }
  }
}

// Without stiffness a particle is free; beyond any stiffness a cluster is rigid; in between nothing else happens.
TEST_P(HardCases, StiffnessFromNoneToAllGoesFromFreeParticlesToARigidBody) {
  const Case c = moving(block(4, 4, 4), 1, 1, 5);
  const auto strain_after = [&](auto change) {
    Instance loaded = undisturbed(c, 1, 0.004);
    EXPECT_EQ(loaded.state.clusters.count(), 1);
    loaded.state.clusters.rotation.front() = Mat3{};
    for (Vec3& x : loaded.state.x) x.x *= 1.25;
    change(loaded.setup.step);
    const Outcome outcome = run(c, loaded, false);
    return greatest_strain(outcome.setup, outcome.last());
  };
  const auto implicit = [&](double k) { return strain_after([k](StepParameters& step) { step.stiffness = k; }); };
  const auto published = [&](double s) { return strain_after([s](StepParameters& step) { relax(step, s); }); };
  constexpr double kClose = 1e-5;
  EXPECT_NEAR(implicit(0), 0.25, kClose);
  EXPECT_NEAR(implicit(1e-9), 0.25, kClose);
  EXPECT_NEAR(implicit(1 / (0.004 * 0.004)), 0.125, kClose) << "s = ½";
  EXPECT_NEAR(implicit(1e15), 0, kClose);
  EXPECT_NEAR(published(1e-12), 0.25, kClose);
  EXPECT_NEAR(published(0.5), 0.125, kClose);
  EXPECT_NEAR(published(1), 0, kClose);
}

TEST_P(HardCases, StepsFromAMicrosecondToATenthOfASecondFallFreelyAndGainNoEnergy) {
  for (const double dt : {1e-6, 1e-4, 1e-2, 0.1}) {
    SCOPED_TRACE(testing::Message() << "dt = " << dt);
    Case c = moving(block(6, 3, 3), 4, 3, 5);
    c.side = 3;
    Instance loaded = undisturbed(c, 2, dt);
    loaded.setup.step.gravity = {0, 0, -9.81};
    // Rest rotations, or the clusters' own would strain it.
    loaded.state = fixtures::cook(loaded.setup.body, {}, loaded.setup.expand, loaded.setup.merge, 1);
    const Outcome fallen = run(c, loaded, false);
    // x after n substeps of implicit Euler from rest: g dt² n (n + 1) / 2.
    const double fall = -9.81 * dt * dt * 8 * 9 / 2;
    const double bound = 1e-5 * std::abs(fall) + 1e-6;
    for (std::size_t p = 0; p < fallen.last().x.size(); ++p) {
      const Vec3 moved = fallen.last().x[p] - loaded.setup.body.rest_position(static_cast<int32_t>(p));
      EXPECT_LE(norm(moved - Vec3{0, 0, fall}), bound) << "particle " << p;
    }

    Random random(wanted_seed());
    for (Vec3& x : loaded.state.x) {
      for (int axis = 0; axis < 3; ++axis) x[axis] += random.real(-0.3, 0.3);
    }
    loaded.setup.step.gravity = {};
    for (const double volume_share : {0.0, 0.9}) {
      loaded.setup.step.volume_share = volume_share;
      run(c, loaded, false);
      for (const Verdict& verdict :
           {oracles::energy_is_monotone(*backend_, loaded.setup, loaded.state, 6),
            oracles::rest_is_fixed(*backend_, loaded.setup, loaded.state),
            oracles::translation_is_exact(*backend_, loaded.setup, loaded.state, {0.3, -0.2, 0.1}),
            oracles::determinism(*backend_, loaded.setup, loaded.state, 2)}) {
        EXPECT_TRUE(verdict.holds) << describe(verdict);
        EXPECT_GT(verdict.checked, 0) << verdict.property;
      }
    }
  }
}

// --- Long, far, at the bounds ----------------------------------------------------------------------------------------

TEST_P(HardCases, AThousandStrokesOnOneBodyKeepEveryInvariant) {
  const int32_t side = is_slow() ? 5 : 13, strokes = is_slow() ? 60 : 1000;
  Case c = with_thin_blade(block(side, side, side));
  c.blade_length = c.blade_depth = 2;
  c.together = 4;
  Random random(wanted_seed());
  std::cout << "seed " << wanted_seed() << std::endl;
  for (int32_t s = 0; s < strokes; ++s) {
    Stroke stroke;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      stroke.from[axis] = random.between(0, 4 * (side - 1));
      stroke.to[axis] = stroke.from[axis] + random.between(-5, 5);
    }
    stroke.back = random.between(0, 5);
    c.strokes.push_back(stroke);
  }
  const Outcome cut = run(c, instance_of(c), false);
  EXPECT_EQ(cut.last().frame, strokes / 4);
  int64_t frames_with_removals = 0, before = static_cast<int64_t>(c.nodes.size());
  for (const State* state : cut.after_every(Stage::skin)) {
    frames_with_removals += alive_in(*state) < before;
    EXPECT_LE(alive_in(*state), before) << "what is dead stays dead";
    before = alive_in(*state);
    for (int32_t k = 0; k < state->clusters.count(); ++k) {
      ASSERT_EQ(state->clusters.number[at(k)], k) << "numbers are compact after a frame";
    }
  }
  EXPECT_GT(frames_with_removals, strokes / 16);
  EXPECT_GT(cut.components(), 1);
  const Verdict thorough = oracles::skin_geometry(cut.setup, cut.last());
  EXPECT_TRUE(thorough.holds) << describe(thorough);
}

TEST_P(HardCases, ABodyAMillionSpacingsFromTheWorldsOriginGivesTheSameBits) {
  Case c = moving(block(6, 4, 4), 2, 2, 5);
  c.spacing = 0.003;
  c.ground = true;
  c.strokes = {{{10, 6, 24}, {10, 6, -4}, 4, true, Link::apart}};
  Instance near = instance_of(c);
  Instance far = near;
  far.setup.body.origin = {1e6 * c.spacing, -1e6 * c.spacing, 1e6 * c.spacing};
  const Outcome a = run(c, near, false), b = run(c, far, false);
  const auto &of_a = a.run.trace.moments, &of_b = b.run.trace.moments;
  ASSERT_EQ(of_a.size(), of_b.size());
  ASSERT_GT(a.removed(), 0);
  for (std::size_t k = 0; k < of_a.size(); ++k) {
    ASSERT_TRUE(*of_a[k].after == *of_b[k].after) << "after stage " << k;
  }
}

// What scenes beyond the bounds are answered with: tests/model/scene_io_test.cpp, for every field. Here: at the bounds,
// or at the least and the most that can still be computed in a test, every backend keeps every invariant.
struct Extreme {
  Extreme(const char* what, void (*of_case)(Case&)) : name(what), edit_case(of_case) {}
  Extreme(const char* what, void (*of_loaded)(Instance&)) : name(what), edit_loaded(of_loaded) {}
  const char* name;
  void (*edit_case)(Case&) = [](Case&) {};
  void (*edit_loaded)(Instance&) = [](Instance&) {};
};

TEST_P(HardCases, ParametersAtTheirBoundsKeepEveryInvariant) {
  const Extreme extremes[] = {
      {"one substep", [](Case& c) { c.substeps = 1; }},
      {"forty substeps", [](Case& c) { c.substeps = 40; }},
      {"no iteration", [](Case& c) { c.iterations = 0; }},
      {"a hundred iterations", [](Case& c) { c.iterations = 100; }},
      {"stiffness 0", [](Instance& l) { l.setup.step.stiffness = 0; }},
      {"stiffness 1e15", [](Instance& l) { l.setup.step.stiffness = 1e15; }},
      {"damping 0", [](Instance& l) { l.setup.step.damping = 0; }},
      {"damping 1e9", [](Instance& l) { l.setup.step.damping = 1e9; }},
      {"relaxation 1", [](Instance& l) { relax(l.setup.step, 1); }},
      {"relaxation 1e-12", [](Instance& l) { relax(l.setup.step, 1e-12); }},
      {"gravity 1e6", [](Instance& l) { l.setup.step.gravity.z = -1e6; }},
      {"debris of everything", [](Instance& l) { l.setup.split.debris = 1'000'000'000; }},
      {"expansion by a thousand layers",
       [](Case& c) {
         c.clusters = ClusterKind::foreign;
         c.most = 2;
         c.expand_depth = 1000;
       }},
      {"tau 0, cap 1",
       [](Instance& l) {
         l.state.tau = 0;
         l.state.cap = 1;
       }},
      {"everything small and no cap",
       [](Instance& l) { l.state.tau = l.state.cap = std::numeric_limits<int32_t>::max(); }},
      {"skin at its particles", [](Instance& l) { l.setup.skin.alpha = 0.01; }},
      {"skin at the next nodes", [](Instance& l) { l.setup.skin.alpha = 0.99; }},
      {"friction 1e6",
       [](Instance& l) {
         l.setup.blade.friction = 1e6;
         for (Wall& wall : l.setup.walls) wall.friction = 1e6;
       }},
      {"the shortest blade", [](Case& c) { c.blade_length = c.blade_depth = 1; }},
      {"boxes of one node", [](Case& c) { c.side = 1; }},
      {"one box", [](Case& c) { c.side = 1000; }},
      {"balls of one node",
       [](Case& c) {
         c.clusters = ClusterKind::sampled;
         c.seed_spacing = c.ball_radius = 2;
       }},
  };
  for (const Extreme& extreme : extremes) {
    SCOPED_TRACE(extreme.name);
    Case c = moving(block(5, 3, 4), 2, 2, 4);
    c.ground = true;
    c.strokes = {{{8, 4, 18}, {8, 4, 2}, 4, true, Link::apart}};
    extreme.edit_case(c);
    Instance loaded = instance_of(c);
    extreme.edit_loaded(loaded);
    const Outcome outcome = run(c, loaded, false);
    EXPECT_EQ(outcome.last().frame, outcome.setup.frame_count());
  }
}

TEST_P(HardCases, AThresholdBelowASpacingRemovesTissueAtRestAndAHugeOneRemovesNothing) {
  Case c = with_thin_blade(block(4, 3, 3));
  c.strokes = {through_x(6)};
  Instance loaded = instance_of(c);
  loaded.setup.detect.criterion = Criterion::distance;
  for (const double epsilon : {1e-9, 0.99}) {
    loaded.setup.detect.epsilon = epsilon;
    EXPECT_EQ(alive_in(run(c, loaded).last()), 0) << "every neighbour is farther than " << epsilon << " h";
  }
  for (const double epsilon : {1.01, 1e6}) {
    loaded.setup.detect.epsilon = epsilon;
    without_blade(loaded.setup);
    loaded.setup.detect.without_blade = true;
    EXPECT_EQ(run(c, loaded).removed(), 0);
  }
}

TEST_P(HardCases, StatesThatDoNotFitTheirSetupAreRefused) {
  Case c = with_thin_blade(block(3, 3, 3));
  c.strokes = {through_x(4)};
  const Instance good = instance_of(c);
  const auto refused = [&](auto spoil) {
    Instance bad = good;
    spoil(bad);
    EXPECT_THROW(backend_->load({bad.setup}, {bad.state}), std::invalid_argument);
  };
  refused([](Instance& l) { l.state.x.pop_back(); });
  refused([](Instance& l) { l.state.v.emplace_back(); });
  refused([](Instance& l) { l.state.alive.clear(); });
  refused([](Instance& l) { l.setup.body.mass.pop_back(); });
  refused([](Instance& l) { l.setup.blade_moves.pop_back(); });
  refused([](Instance& l) { l.state.clusters.number.pop_back(); });
  refused([](Instance& l) { l.state.clusters.members.back() = 27; });
  refused([](Instance& l) { l.state.clusters.members.front() = -1; });
  refused([](Instance& l) { l.state.clusters.offsets.back() += 1; });
  EXPECT_THROW(backend_->load({good.setup, good.setup}, {good.state}), std::invalid_argument);
  run(c);  // and can be loaded anew
}

INSTANTIATE_TEST_SUITE_P(Over, HardCases, ::testing::ValuesIn(all_backends()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace cutproof::property_tests
