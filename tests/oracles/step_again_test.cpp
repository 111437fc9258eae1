// A step computed again: the reference's holds, and what is least wrong does not.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "oracles/oracles.h"
#include "oracles/step_model/admissible_step.h"
#include "oracles/step_model/step_model.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"
#include "tests/oracles/pressed_block.h"

namespace cutproof::oracles::step_again_test {
namespace {

using namespace cutproof::tests;

// Off by so much that single roundings do not explain it, but what disturbed runs make of them does, or does not.
TEST(AdmissibleStep, IsTheSameHoweverManyRunsGoAtTheSameTime) {
  StepScene scene = pressed_block();
  round_to_single(scene.setup.body, scene.before);
  scene.take_step();
  round_to_single(scene.setup.body, scene.after);
  const auto found = [&](int at_once) {
    return nearest_admissible_step(scene.setup, scene.before, scene.after, {}, at_once);
  };
  const double surely = found(1).position_bound[kInside];
  scene.after.x[kInside].y += 1.5 * surely * kSpacing;
  const AdmissibleStep one = found(1);
  EXPECT_GT(one.position_bound[kInside], 1.1 * surely) << "nobody has looked closer";
  for (const int at_once : {2, 3, 8, 100}) {
    const AdmissibleStep several = found(at_once);
    EXPECT_EQ(several.holds, one.holds);
    EXPECT_EQ(several.measured, one.measured);
    EXPECT_EQ(several.bound, one.bound);
    EXPECT_EQ(several.position_bound, one.position_bound);
    EXPECT_EQ(several.velocity_bound, one.velocity_bound);
    EXPECT_EQ(several.rotation_bound, one.rotation_bound);
  }
}

TEST(AdmissibleStep, IsTheReferencesWithEveryCauseAtWork) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      for (const double retardation : {0.0, 0.0004, 0.004, 0.1}) {  // dt is 4 ms
        if (solver == Solver::published && (acceleration != Acceleration::none || retardation > 0)) continue;
        const StepScene scene = pressed_block(solver, acceleration, retardation);
        const Verdict verdict = admissible_step(scene.setup, scene.before, scene.after);
        expect_holds(verdict);
        EXPECT_EQ(verdict.inconclusive, 0);
        EXPECT_GT(verdict.measured, 0.01 * verdict.bound) << "the bound must be near to what it bounds";
        EXPECT_LT(verdict.bound, 1e-11) << "[h]";
      }
    }
  }
}

// Off by a hundredth of itself, or left out; and any where there should be none, in double from 1e-4 dt on.
TEST(AdmissibleStep, RejectsAnotherRetardation) {
  const double dt = pressed_block().setup.substep_length[0];
  for (const double retardation : {0.1 * dt, dt, 20 * dt}) {
    const StepScene good = pressed_block(Solver::implicit, Acceleration::none, retardation);
    StepScene single = good;
    round_to_single(single.setup.body, single.before);
    for (const StepScene* scene : {&good, &std::as_const(single)}) {
      const auto judged = [&](const auto& edit) {
        StepScene other = *scene;
        edit(other.setup);
        other.take_step();
        if (scene == &single) round_to_single(other.setup.body, other.after);
        return admissible_step(scene->setup, scene->before, other.after);
      };
      expect_holds(judged([](cutproof::Setup&) {}));
      EXPECT_FALSE(judged([](cutproof::Setup& s) { s.step.retardation *= 1.01; }).holds) << retardation;
      EXPECT_FALSE(judged([](cutproof::Setup& s) { s.step.retardation = 0; }).holds) << retardation;
      EXPECT_FALSE(judged([](cutproof::Setup& s) { s.step.stiffness *= 1.001; }).holds) << retardation;
      EXPECT_FALSE(judged([](cutproof::Setup& s) { s.walls[0].offset += 1e-3 * kSpacing; }).holds) << retardation;
      EXPECT_FALSE(judged([](cutproof::Setup& s) { s.walls[0].friction *= 1.001; }).holds) << retardation;
      EXPECT_FALSE(judged([](cutproof::Setup& s) { --s.step.iterations; }).holds) << retardation;
    }
  }
  const StepScene plain = pressed_block();
  const StepScene retarded = pressed_block(Solver::implicit, Acceleration::none, 1e-4 * dt);
  EXPECT_FALSE(admissible_step(plain.setup, plain.before, retarded.after).holds);
}

// The least that is rejected: in double precision some hundred roundings, 1e-12 h; in single precision 1e-4 h.
TEST(AdmissibleStep, RejectsTheLeastDisturbances) {
  const StepScene good = pressed_block();
  StepScene single = good;
  round_to_single(single.setup.body, single.before);
  single.take_step();
  round_to_single(single.setup.body, single.after);
  expect_holds(admissible_step(single.setup, single.before, single.after));
  const double dt = good.setup.substep_length[0];
  struct Disturbance {
    const char* name;
    double in_double, in_single;  // [h], [h/dt], [rad], of the body's mass times [h/dt]
    std::function<void(State&, double)> put;
  };
  const auto mass = 0.002 * static_cast<double>(good.before.x.size());
  for (const Disturbance& disturbance : std::initializer_list<Disturbance>{
           {"position", 1e-12, 1e-4, [](State&s, double by) { s.x[kInside].y += by * kSpacing; }},
           {"velocity", 2e-12, 2e-4, [&](State&s, double by) { s.v[kInside].z += by * kSpacing / dt; }},
           // All that is left of this without what neighbours share is nothing.
           {"position", 1e-12, 1e-4,
            [](State&s, double by) {
              for (Vec3& x : s.x) x.y += by * kSpacing;
            }},
           {"velocity", 2e-12, 2e-4,
            [&](State&s, double by) {
              for (Vec3& v : s.v) v.z += by * kSpacing / dt;
            }},
           {"rotation", 1e-12, 1e-4,
            [](State&s, double by) {
              Mat3& r = s.clusters.rotation[1];
              for (int row = 0; row < 3; ++row) r(row, 0) += by * r(row, 1);
            }},
           {"impulse", 1e-11, 2e-5, [&](State&s, double by) { s.impulse.x += by * mass * kSpacing / dt; }}}) {
    for (const StepScene* scene : {&good, &std::as_const(single)}) {
      State wrong = scene->after;
      const double by = scene == &good ? disturbance.in_double : disturbance.in_single;
      disturbance.put(wrong, by);
      const Verdict verdict = admissible_step(scene->setup, scene->before, wrong);
      EXPECT_FALSE(verdict.holds) << disturbance.name << " off by " << by << ", bound " << verdict.bound;
      EXPECT_NE(verdict.witness.text.find(disturbance.name), std::string::npos) << verdict.witness.text;
    }
  }
}

// What rounds in a cluster as a whole is much more than what rounds in each of its members: one that is off alone shows
// beside its neighbours, well within the bound of its position.
TEST(AdmissibleStep, SeesOneParticleBesideItsNeighbours) {
  StepScene scene{setup_of(block_body(9, 6, 6, kSpacing, 0.002)), {}, {}};
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.before = state_of(scene.setup.body, box_clusters(9, 6, 6, 4));
  for (std::size_t i = 0; i < scene.before.x.size(); ++i) {
    const Vec3 x = scene.before.x[i];
    scene.before.v[i] = {0.3 - 4 * x.y, 4 * x.x, -0.5};
  }
  round_to_single(scene.setup.body, scene.before);
  scene.take_step();
  round_to_single(scene.setup.body, scene.after);
  expect_holds(admissible_step(scene.setup, scene.before, scene.after));
  const std::size_t inside = 4 + 9 * (2 + 6 * 2);
  const double dt = scene.setup.substep_length[0];
  State wrong = scene.after;
  wrong.x[inside].y += 1.5e-5 * kSpacing;
  Verdict verdict = admissible_step(scene.setup, scene.before, wrong);
  EXPECT_FALSE(verdict.holds) << verdict.bound;
  EXPECT_NE(verdict.witness.text.find("own position of particle"), std::string::npos) << verdict.witness.text;
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{static_cast<int32_t>(inside)});
  wrong = scene.after;
  wrong.v[inside].z += 1e-5 * kSpacing / dt;
  verdict = admissible_step(scene.setup, scene.before, wrong);
  EXPECT_FALSE(verdict.holds) << verdict.bound;
  EXPECT_NE(verdict.witness.text.find("own velocity of particle"), std::string::npos) << verdict.witness.text;
}

// A simulator that has one of these a little wrong.
TEST(AdmissibleStep, RejectsParametersThatAreOffByAThousandth) {
  const StepScene good = pressed_block();
  StepScene single = good;
  round_to_single(single.setup.body, single.before);
  using Edit = std::function<void(cutproof::Setup&)>;
  for (const auto& [name, edit] : std::initializer_list<std::pair<const char*, Edit>>{
           {"stiffness", [](cutproof::Setup& s) { s.step.stiffness *= 1.001; }},
           {"gravity", [](cutproof::Setup& s) { s.step.gravity.z *= 1.001; }},
           {"damping", [](cutproof::Setup& s) { s.step.damping *= 1.001; }},
           {"friction of the floor", [](cutproof::Setup& s) { s.walls[0].friction *= 1.001; }},
           {"friction of the blade", [](cutproof::Setup& s) { s.blade.friction *= 1.001; }},
           {"place of the floor", [](cutproof::Setup& s) { s.walls[0].offset += 1e-3 * kSpacing; }},
           {"thickness of the blade", [](cutproof::Setup& s) { s.detect.epsilon *= 1.001; }},
           {"way of a grip", [](cutproof::Setup& s) { s.grips[0].displacement[3].x *= 1.001; }},
           {"length of a substep", [](cutproof::Setup& s) { s.substep_length[0] *= 1.001; }},
           {"iterations", [](cutproof::Setup& s) { --s.step.iterations; }},
           {"no iterations", [](cutproof::Setup& s) { s.step.iterations = 0; }},
           {"solver", [](cutproof::Setup& s) { s.step.solver = Solver::published; }},
           {"acceleration", [](cutproof::Setup& s) { s.step.acceleration = Acceleration::chebyshev; }}}) {
    for (const StepScene* scene : {&good, &std::as_const(single)}) {
      StepScene wrong = *scene;
      edit(wrong.setup);
      wrong.take_step();
      if (scene == &single) round_to_single(wrong.setup.body, wrong.after);
      EXPECT_FALSE(admissible_step(scene->setup, scene->before, wrong.after).holds)
          << name << (scene == &good ? "" : ", in single precision");
    }
  }
}

// A thin blade that stands in the plane x = `plane.x`, over everything.
void stand_in_plane(cutproof::Setup& setup, Vec3 plane) {
  setup.has_blade = true;
  setup.blade = {0.4, 0.4, 0, 0};
  BladeMove move;
  move.down = true;
  move.from = {{plane.x, plane.y, plane.z - 0.1}, {0, 1, 0}, {0, 0, 1}};
  move.to = move.from;
  setup.blade_moves.assign(static_cast<std::size_t>(setup.step.substeps), move);
  setup.stroke_end = {0};
}

// Two particles that nothing joins but one cluster, both exactly in the plane of a blade: each may be on either side.
struct PairInThePlane {
  StepScene scene;
  std::vector<State> outcomes;  // by the sides of both, positive and negative
};
PairInThePlane pair_in_the_plane(int32_t iterations) {
  PairInThePlane pair{{setup_of(block_body(1, 1, 4, kSpacing, 0.002)), {}, {}}, {}};
  cutproof::Setup& setup = pair.scene.setup;
  setup.step.substeps = 1;
  setup.step.iterations = iterations;
  stand_in_plane(setup, setup.body.rest_position(0));
  pair.scene.before = state_of(setup.body, {{0, 1}, {1, 2, 3}});
  // Two away from the plane, so that only the others are open.
  pair.scene.before.x[1].x += 2 * kSpacing;
  pair.scene.before.x[3].x -= 2 * kSpacing;
  round_to_single(setup.body, pair.scene.before);
  for (const double first : {+1.0, -1.0}) {
    for (const double second : {+1.0, -1.0}) {
      StepScene led = pair.scene;
      led.before.x[0].x += first * 1e-15;
      led.before.x[2].x += second * 1e-15;
      led.take_step();
      round_to_single(setup.body, led.after);
      pair.outcomes.push_back(led.after);
    }
  }
  return pair;
}

TEST(AdmissibleStep, MayGoToEitherSideOfABladeFromItsPlane) {
  const PairInThePlane pair = pair_in_the_plane(3);
  for (const State& outcome : pair.outcomes) {
    EXPECT_GT(norm(outcome.x[0] - pair.scene.before.x[0]), 0.1 * kSpacing);
    expect_holds(admissible_step(pair.scene.setup, pair.scene.before, outcome));
  }
}

TEST(AdmissibleStep, IsOneOutcomeForAllThatIsCoupled) {
  const PairInThePlane pair = pair_in_the_plane(3);
  // Every particle is where some outcome has it, but no outcome has them all.
  State mixed = pair.outcomes[0];
  mixed.x[3] = pair.outcomes[3].x[3];
  mixed.v[3] = pair.outcomes[3].v[3];
  ASSERT_GT(norm(mixed.x[3] - pair.outcomes[0].x[3]), 1e-3 * kSpacing);
  const Verdict verdict = admissible_step(pair.scene.setup, pair.scene.before, mixed);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.inconclusive, 0);
}

TEST(AdmissibleStep, IsNotWhatOnlyATieCouldExcuse) {
  const PairInThePlane pair = pair_in_the_plane(3);
  for (const double off : {1e-4, 1e-2, 1.0, 50.0}) {
    State wrong = pair.outcomes[1];
    wrong.x[0].x += off * kSpacing;
    EXPECT_FALSE(admissible_step(pair.scene.setup, pair.scene.before, wrong).holds) << off << " h";
  }
}

// Where particles end tells on which side they began the last substep; what is wrong besides is rejected, however many
// there are. On which side they began earlier ones it tells only if nothing is wrong besides.
TEST(AdmissibleStep, TakesManyTiesAsTheyWereAndExcusesNothingElse) {
  for (const int32_t substeps : {1, 2}) {
    StepScene scene{setup_of(block_body(5, 6, 6, kSpacing, 0.002)), {}, {}};
    cutproof::Setup& setup = scene.setup;
    setup.step.substeps = substeps;
    stand_in_plane(setup, setup.body.rest_position(2));
    scene.before = state_of(setup.body, box_clusters(5, 6, 6, 3));
    round_to_single(setup.body, scene.before);
    // All 36 of the middle layer go their own ways.
    StepScene led = scene;
    for (std::size_t i = 0; i < led.before.x.size(); ++i) {
      if (i % 5 == 2) led.before.x[i].x += (i * 7 % 3 == 0 ? 1 : -1) * 1e-15;
    }
    led.take_step();
    round_to_single(setup.body, led.after);
    const Verdict verdict = admissible_step(setup, scene.before, led.after);
    expect_holds(verdict);
    EXPECT_EQ(verdict.inconclusive, 0);
    if (substeps > 1) continue;
    State wrong = led.after;
    wrong.v[0].y += 0.1 * kSpacing / setup.substep_length[0];
    EXPECT_FALSE(admissible_step(setup, scene.before, wrong).holds);
    // No particle moves otherwise than its neighbours do.
    wrong = led.after;
    for (Vec3& v : wrong.v) v.y += 0.1 * kSpacing / setup.substep_length[0];
    EXPECT_FALSE(admissible_step(setup, scene.before, wrong).holds);
    wrong = led.after;
    wrong.impulse.x += 0.01;
    EXPECT_FALSE(admissible_step(setup, scene.before, wrong).holds);
    // The simulator that is too soft has the same ties.
    led.setup.step.stiffness *= 0.1;
    led.take_step();
    round_to_single(setup.body, led.after);
    EXPECT_FALSE(admissible_step(setup, scene.before, led.after).holds);
  }
}

// The blade is gone before the step ends, so that no place tells on which side 225 particles began. All that is coupled
// with them is inconclusive, up to where any sides could lead: where each side is a coin's, and where a backend has to
// be ten roundings off to see the other one.
TEST(AdmissibleStep, LeavesOpenWhatHangsOnSidesOfWhichNoPlaceTells) {
  for (const double off : {0.0, 8e-8}) {
    SCOPED_TRACE(off);
    StepScene scene{setup_of(block_body(5, 15, 15, kSpacing, 0.002)), {}, {}};
    cutproof::Setup& setup = scene.setup;
    setup.step.substeps = 2;
    setup.detect.epsilon = 0.05;
    stand_in_plane(setup, setup.body.rest_position(2));
    setup.blade_moves[1].down = false;
    for (BladePose* pose : {&setup.blade_moves[1].from, &setup.blade_moves[1].to}) pose->edge.y += 10;
    scene.before = state_of(setup.body, box_clusters(5, 15, 15, 3));
    round_to_single(setup.body, scene.before);
    StepScene led = scene;
    for (std::size_t i = 2; i < led.before.x.size(); i += 5) {
      scene.before.x[i].x += off;
      led.before.x[i].x += (i * 7 % 3 == 0 ? 1 : -1) * std::max(off, 1e-15);
    }
    led.take_step();
    round_to_single(setup.body, led.after);
    const Verdict verdict = admissible_step(setup, scene.before, led.after);
    expect_holds(verdict);
    EXPECT_GE(verdict.inconclusive, scene.setup.body.particle_count());
    State wrong = led.after;
    wrong.x[2].y += 20 * kSpacing;
    EXPECT_FALSE(admissible_step(setup, scene.before, wrong).holds);
    wrong = led.after;
    wrong.v[0].y += 100 * kSpacing / setup.substep_length[0];
    EXPECT_FALSE(admissible_step(setup, scene.before, wrong).holds);
  }
}

// Half a turn from the previous rotation every one along the wire is as near as another, but none that is not along it.
TEST(AdmissibleStep, FollowsTheRotationThatWasTakenAfterHalfATurn) {
  StepScene scene{setup_of(block_body(5, 1, 1, kSpacing)), {}, {}};
  scene.before = state_of(scene.setup.body, {{0, 1, 2, 3, 4}});
  scene.before.clusters.rotation[0] = {{-1, 0, 0, 0, -1, 0, 0, 0, 1}};
  scene.take_step();
  expect_holds(admissible_step(scene.setup, scene.before, scene.after));
  scene.after.clusters.rotation[0] = {{1, 0, 0, 0, 0, -1, 0, 1, 0}};
  expect_holds(admissible_step(scene.setup, scene.before, scene.after));
  for (const double angle : {1e-6, 1e-3, 1.0}) {
    State wrong = scene.after;
    wrong.clusters.rotation[0] = {{std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1}};
    EXPECT_FALSE(admissible_step(scene.setup, scene.before, wrong).holds) << angle;
  }
}

// A rotation that nobody states excuses what is coupled with it, and not the impulse.
TEST(AdmissibleStep, RejectsAnImpulseBesideARotationThatIsNotStated) {
  StepScene scene{setup_of(block_body(5, 1, 1, kSpacing)), {}, {}};
  scene.before = state_of(scene.setup.body, {{0, 1, 2, 3, 4}});
  scene.before.clusters.rotation[0] = {{-1, 0, 0, 0, -1, 0, 0, 0, 1}};
  scene.take_step();
  const std::vector<RotationKnown> known = {RotationKnown::no};
  const auto holds = [&] { return nearest_admissible_step(scene.setup, scene.before, scene.after, known).holds; };
  EXPECT_TRUE(holds());
  scene.after.impulse.x += 1e-3 * scene.setup.body.mass[0] * kSpacing / scene.setup.substep_length[0];
  EXPECT_FALSE(holds());
}

// A pair that contacts have pressed together falls apart along one coordinate in some disturbed run, this way and that:
// that is how rounding leaves it on an edge. In another it keeps its rotation, as where a backend finds nothing but
// zeros. No direction at random comes so near.
TEST(StepModel, DrawsEachCoordinateWhereAMatrixIsLostAndThePreviousRotation) {
  StepScene scene{setup_of(block_body(2, 1, 1, kSpacing)), {}, {}};
  cutproof::Setup& setup = scene.setup;
  setup.step.substeps = 1;
  setup.step.iterations = 1;
  scene.before = state_of(setup.body, {{0, 1}});
  scene.before.x[1] = scene.before.x[0];
  scene.before.clusters.rotation[0] = {{0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6}};
  const StepModel model(setup, scene.before, 0x1p-24);
  const auto nearest_to = [&](Vec3 way) {
    double nearest = 2;
    for (uint64_t run = 1; run <= 48; ++run) {
      const Mat3 r = model.run({run, {}, {}, {}}).rotation[0];
      nearest = std::min(nearest, norm(Vec3{r(0, 0), r(1, 0), r(2, 0)} - way));
    }
    return nearest;
  };
  for (const Vec3 way : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    EXPECT_LT(nearest_to(way), 1e-5);
    EXPECT_LT(nearest_to(-1 * way), 1e-5);
  }
  EXPECT_LT(nearest_to({0.36, -0.8, 0.48}), 1e-5);
  // In every run of that kind.
  for (uint64_t run = 3; run <= 48; run += 4) {
    const StepOutcome outcome = model.run({run, {}, {}, {}});
    double off = 0;
    for (std::size_t k = 0; k < 9; ++k) {
      off = std::max(off, std::abs(outcome.rotation[0].m[k] - scene.before.clusters.rotation[0].m[k]));
    }
    EXPECT_LT(off, 1e-5) << "run " << run;
  }
}

// A layer that rests on a wall exactly, beside a blade, in accelerated iterations: where rounding puts the wall decides
// nothing, because what nearly touches counts as touching.
TEST(AdmissibleStep, TakesALayerOnAWallAsOneRoundingPutsIt) {
  for (const double off : {-1e-9, +1e-9}) {
    StepScene scene{setup_of(block_body(4, 4, 3, kSpacing, 0.002)), {}, {}};
    cutproof::Setup& setup = scene.setup;
    setup.step.acceleration = Acceleration::chebyshev;
    setup.step.substeps = 1;
    setup.step.iterations = 4;
    setup.step.gravity = {};
    stand_in_plane(setup, setup.body.rest_position(0) + Vec3{1.5 * kSpacing, 0, 0});
    setup.walls = {{2, +1, setup.body.rest_position(0).z, 0.3}};
    scene.before = state_of(setup.body, box_clusters(4, 4, 3, 2));
    for (Vec3& v : scene.before.v) v = {0.2, 0.1, 0};
    round_to_single(setup.body, scene.before);
    StepScene taken = scene;
    taken.setup.walls[0].offset += off * kSpacing;
    taken.take_step();
    round_to_single(setup.body, taken.after);
    const Verdict verdict = admissible_step(setup, scene.before, taken.after);
    expect_holds(verdict);
    EXPECT_EQ(verdict.inconclusive, 0);
    taken.setup.step.stiffness *= 0.1;
    taken.take_step();
    round_to_single(setup.body, taken.after);
    EXPECT_FALSE(admissible_step(setup, scene.before, taken.after).holds);
  }
}

// A sheet that has slid 250 h, and that friction holds now: all numbers along that way are equal, and round alike.
TEST(AdmissibleStep, KnowsThatEqualNumbersRoundAlike) {
  StepScene scene{setup_of(block_body(40, 40, 1, kSpacing, 0.002)), {}, {}};
  cutproof::Setup& setup = scene.setup;
  setup.step.gravity = {0, 0, -9.81};
  scene.before = state_of(setup.body, box_clusters(40, 40, 1, 4));
  for (Vec3& x : scene.before.x) x.x += 250 * kSpacing;
  round_to_single(setup.body, scene.before);
  setup.walls = {{.axis = 2, .side = +1, .offset = scene.before.x[0].z, .friction = 1}};
  scene.take_step();
  round_to_single(setup.body, scene.after);
  expect_holds(admissible_step(setup, scene.before, scene.after));
  // What a contact gives back of what has rounded away, of each particle the same. In each evaluation a center rounds
  // twice and a place once: as much as half of that, all one way.
  const Vec3 one_rounding = {0x1p-24 * 250 * kSpacing * 0.002 * 1600 / setup.substep_length[0], 0, 0};
  State off = scene.after;
  const double worst = 3.0 * setup.step.substeps * (setup.step.iterations + 1);
  off.impulse += worst / 2 * one_rounding;
  expect_holds(admissible_step(setup, scene.before, off));
  off.impulse += 3 * worst * one_rounding;
  EXPECT_FALSE(admissible_step(setup, scene.before, off).holds);
}

// Two particles at one place: how they fall apart is open, and by how far as well. One of them is pressed on a wall
// with friction: more firmly than the other can pull, so that it is asked as sharply as any, or so loosely that it may
// slip.
TEST(AdmissibleStep, AsksSharplyWhatAContactHoldsFirmly) {
  for (const bool firmly : {true, false}) {
    StepScene scene{setup_of(block_body(2, 1, 1, kSpacing)), {}, {}};
    cutproof::Setup& setup = scene.setup;
    setup.step.substeps = 1;
    setup.step.iterations = 2;
    setup.step.stiffness = 1000;
    setup.step.gravity = {};
    scene.before = state_of(setup.body, {{0, 1}});
    scene.before.x[1] = scene.before.x[0];
    setup.walls = {{.axis = 2, .side = +1, .offset = scene.before.x[0].z, .friction = 0.5}};
    scene.before.v[0].z = -(firmly ? 0.5 : 0.02) * kSpacing / setup.substep_length[0];
    scene.take_step();
    const Verdict verdict = admissible_step(setup, scene.before, scene.after);
    expect_holds(verdict);
    scene.after.x[0].x += 1e-9 * kSpacing;
    EXPECT_EQ(admissible_step(setup, scene.before, scene.after).holds, !firmly);
    scene.after.x[0].x += kSpacing;
    EXPECT_FALSE(admissible_step(setup, scene.before, scene.after).holds);
  }
}

// Along a wire the best rotations are many: only the nearest to the previous one is right.
TEST(AdmissibleStep, HasNoFreeAxis) {
  StepScene scene{setup_of(block_body(5, 1, 1, kSpacing)), {}, {}};
  scene.before = state_of(scene.setup.body, {{0, 1, 2, 3, 4}});
  scene.take_step();
  expect_holds(admissible_step(scene.setup, scene.before, scene.after));
  const double angle = 1e-6;
  scene.after.clusters.rotation[0] = {
      {1, 0, 0, 0, std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle)}};
  const Verdict verdict = admissible_step(scene.setup, scene.before, scene.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, (Numbers{0}));
}

TEST(AdmissibleStep, KeepsTheRotationOfASingleParticle) {
  StepScene scene{setup_of(block_body(1, 1, 1, kSpacing)), {}, {}};
  scene.before = state_of(scene.setup.body, {{0}});
  scene.before.clusters.rotation[0] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  scene.before.v[0] = {0.1, 0.2, 0.3};
  scene.take_step();
  expect_holds(admissible_step(scene.setup, scene.before, scene.after));
  scene.after.clusters.rotation[0] = Mat3{};
  EXPECT_FALSE(admissible_step(scene.setup, scene.before, scene.after).holds);
}

TEST(AdmissibleStep, IsNotAskedOfNumbersThatAreNoneNorBeyondTheSchedule) {
  StepScene scene = pressed_block();
  State broken = scene.before;
  broken.v[3].x = kNan;
  const Verdict verdict = admissible_step(scene.setup, broken, scene.after);
  EXPECT_TRUE(verdict.holds);
  EXPECT_EQ(verdict.checked, 0);
  State off = scene.after;
  off.x[3].x = kNan;
  EXPECT_FALSE(admissible_step(scene.setup, scene.before, off).holds);
  State over = scene.before;
  over.frame = 1;
  EXPECT_EQ(admissible_step(scene.setup, over, over).checked, 0);
}

}  // namespace
}  // namespace cutproof::oracles::step_again_test
