// Stage step of the kernels, executed on the host, against the double-precision reference from the same state, and
// against what must hold of any answer.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/host/host_launcher.h"
#include "gpu/kernels/step/step.cuh"
#include "gpu/state/staging.h"
#include "reference_cpu/contacts.h"
#include "reference_cpu/reference.h"

namespace cutproof::gpu::step_kernel_test {
namespace {

constexpr double kUnit = 0x1p-24;  // relative error of one rounding in single precision

using Random = std::mt19937_64;
double normal(Random& random) { return std::normal_distribution<double>()(random); }
double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 vector(Random& random) { return {normal(random), normal(random), normal(random)}; }

Setup setup_of(Body body, double dt = 0.004, int64_t frames = 1) {
  Setup setup;
  setup.body = std::move(body);
  setup.substep_length.assign(static_cast<std::size_t>(frames), dt);
  return setup;
}

State cooked(const Setup& setup, int side = 3) {
  ClusterSpec spec;
  spec.side = side;
  return fixtures::cook(setup.body, spec, setup.expand, setup.merge, 1);
}

void perturb(const Setup& setup, State& state, Random& random) {
  const double h = setup.body.grid.spacing;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.x[i] += (0.1 * h) * vector(random);
    state.v[i] = (3 * h) * vector(random);
  }
}

// A few frames of the kernels' step stage on states of several bodies.
std::vector<State> kernel_steps(HostLauncher& launcher, const std::vector<Setup>& setups,
                                const std::vector<State>& states, int frames = 1) {
  StagingBuffers staging = make_staging_buffers(setups, states, Capacity{});
  const DeviceView view = staging.view();
  const Plan plan = make_plan(setups, states);
  for (int f = 0; f < frames; ++f) {
    enqueue_step(launcher, view, plan, Span{Stage::step, Stage::step});
    for (std::size_t b = 0; b < setups.size(); ++b) staging.frame[b] += staging.frame[b] < setups[b].frame_count();
  }
  return extract_states(staging, setups);
}

State kernel_step(const Setup& setup, const State& state) {
  HostLauncher launcher;
  return kernel_steps(launcher, {setup}, {state}).front();
}

// The state with positions and velocities as single precision keeps them: what both sides start from.
State seeded(const Setup& setup, State state) {
  const StagingBuffers staging = make_staging_buffers({setup}, {state}, Capacity{});
  const State kept = extract_states(staging, {setup}).front();
  state.x = kept.x;
  state.v = kept.v;
  return state;
}

double greatest_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double greatest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double distance = norm(a[i] - b[i]);
    if (!(distance <= greatest)) greatest = distance;  // NaN is greater than everything
  }
  return greatest;
}

Vec3 momentum(const Setup& setup, const State& state) {
  Vec3 sum;
  for (std::size_t i = 0; i < state.v.size(); ++i) {
    if (state.alive[i]) sum += setup.body.mass[i] * state.v[i];
  }
  return sum;
}

double total_mass(const Setup& setup) {
  double sum = 0;
  for (const double m : setup.body.mass) sum += m;
  return sum;
}

bool same_bits(const State& a, const State& b) {
  return a.x == b.x && a.v == b.v && a.clusters.rotation == b.clusters.rotation && a.impulse == b.impulse;
}

// Error of one frame from rounding, without contacts. An evaluation of a goal or position errs by a few units u of D +
// l, D the greatest displacement and l the half diagonal of a cluster: centre 1, rotation 5,
// update 2. A velocity carries the error of a substep to all later ones: S (S + 1) / 2 in all. Iterations do not add
// up: what one hands to the next is averaged over the members of a cluster.
double frame_bound(const Setup& setup, const State& before, const State& after) {
  const double h = setup.body.grid.spacing;
  double moved = 0, half_diagonal = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    const auto p = static_cast<std::size_t>(i);
    const Vec3 rest = setup.body.rest_position(i);
    moved = std::max({moved, norm(before.x[p] - rest), norm(after.x[p] - rest)});
  }
  for (int32_t c = 0; c < before.clusters.count(); ++c) {
    for (const int32_t i : before.clusters.of(c)) {
      half_diagonal = std::max(
          half_diagonal, norm(setup.body.rest_position(i) - before.clusters.rest_center[static_cast<std::size_t>(c)]));
    }
  }
  const double substeps = setup.step.substeps;
  return 8 * kUnit * (moved + half_diagonal + h) * substeps * (substeps + 1) / 2;
}

// By how much the reference's own answer changes if positions are moved by one rounding of a coordinate. Round the rim
// of the blade, or wedged between blade and wall, a contact turns a small change into a large one.
double response(const Setup& setup, const State& before, const State& after, Random& random) {
  double farthest = 0;
  for (const Vec3& x : before.x) farthest = std::max(farthest, norm(x));
  double greatest = 0;
  for (int trial = 0; trial < 4; ++trial) {
    State moved = before;
    for (Vec3& x : moved.x) x += (kUnit * farthest) * vector(random);
    reference::step(setup, moved);
    greatest = std::max(greatest, greatest_distance(moved.x, after.x));
  }
  return greatest;
}

constexpr BladePose kStanding = {{0.045, 0.045, 0.035}, {1, 0, 0}, {0, 0, 1}};

// Everything that can push: a wall with friction, a blade that moves down through the body, a grip.
void add_contacts(Setup& setup, double friction, Random& random) {
  const auto substeps = static_cast<std::size_t>(setup.frame_count() * setup.step.substeps);
  const double h = setup.body.grid.spacing;
  setup.walls = {{2, +1, 1.3 * h, friction}, {0, -1, (setup.body.grid.nodes[0] - 2.4) * h, 0}};
  setup.has_blade = true;
  setup.blade = {4 * h, 6 * h, 0.5 * h, friction};
  BladePose pose = kStanding;
  pose.edge = {0.45 * setup.body.grid.nodes[0] * h, 0.5 * setup.body.grid.nodes[1] * h,
               0.5 * setup.body.grid.nodes[2] * h};
  setup.blade_moves.clear();
  for (std::size_t s = 0; s < substeps; ++s) {
    BladePose next = pose;
    next.edge += Vec3{0.1 * h * normal(random), 0.1 * h * normal(random), -0.3 * h};
    const double angle = 0.05 * normal(random);
    next.along = {std::cos(angle), std::sin(angle), 0};
    setup.blade_moves.push_back({pose, next, s % 4 != 3, 0});
    pose = next;
  }
  Grip grip;
  grip.particles = {0, 1, 2};
  for (std::size_t s = 0; s < substeps; ++s) {
    grip.active.push_back(s % 3 != 2);
    grip.displacement.push_back((0.1 * h) * vector(random));
  }
  setup.grips = {grip};
}

struct Iteration {
  Solver solver;
  Acceleration acceleration;
};
constexpr Iteration kIterations[] = {{Solver::implicit, Acceleration::none},
                                     {Solver::implicit, Acceleration::chebyshev},
                                     {Solver::published, Acceleration::none}};

TEST(GpuStep, MeetsTheReferenceWithinItsRounding) {
  Random random(21);
  double worst = 0;
  for (const auto& [solver, acceleration] : kIterations) {
    for (int trial = 0; trial < 32; ++trial) {
      const auto below = [&](int count) { return static_cast<int>(uniform(random, 0, count)); };
      cutproof::Setup setup = setup_of(fixtures::block(3 + below(8), 3 + below(8), 3 + below(8), 0.01));
      setup.step.solver = solver;
      setup.step.acceleration = acceleration;
      setup.step.substeps = 1 + below(4);
      setup.step.iterations = below(6);
      setup.step.stiffness = std::pow(10, uniform(random, 3, 6));
      setup.step.damping = below(3);
      setup.step.gravity = {0.1, 0, -9.81};
      // Nothing, the blade, walls, and all at once with friction. Not all at once without: the two sides would accept
      // or refuse a point between blade and wall (method.md §3) by comparing distances that differ by rounding.
      const int kind = trial % 4;
      if (kind > 0) add_contacts(setup, kind == 3 ? 0.4 : 0.0, random);
      if (kind == 1) setup.walls.clear();
      if (kind == 2) setup.has_blade = false;
      State state = cooked(setup, 2 + below(4));
      perturb(setup, state, random);
      state = seeded(setup, state);
      State expected = state;
      reference::step(setup, expected);
      const State reached = kernel_step(setup, state);
      const double h = setup.body.grid.spacing, dt = setup.substep_length[0];
      double bound = frame_bound(setup, state, expected);
      EXPECT_LE(bound, 1e-4 * h) << "the goal of tolerances.md, Against the reference";
      if (kind > 0) bound += 5 * response(setup, state, expected, random);
      const double error = greatest_distance(reached.x, expected.x);
      worst = std::max(worst, error / h);
      EXPECT_LE(error, bound) << "trial " << trial;
      EXPECT_LE(greatest_distance(reached.v, expected.v), 2 * bound / dt) << "trial " << trial;
      EXPECT_LE(norm(reached.impulse - expected.impulse), 2 * bound / dt * total_mass(setup)) << "trial " << trial;
      EXPECT_EQ(reached.clusters.degenerate, expected.clusters.degenerate) << "trial " << trial;
      if (kind > 0) {
        EXPECT_GT(norm(reached.impulse), 0) << "trial " << trial << " touched nothing";
      }
    }
  }
  std::printf("greatest error of a frame: %.1e h\n", worst);
}

TEST(GpuStep, MeetsTheReferenceNearRest) {
  Random random(22);
  cutproof::Setup setup = setup_of(fixtures::block(7, 6, 5, 0.01));
  State state = cooked(setup);
  perturb(setup, state, random);
  state = seeded(setup, state);
  State expected = state;
  reference::step(setup, expected);
  EXPECT_LE(greatest_distance(kernel_step(setup, state).x, expected.x), 1e-4 * 0.01);
}

TEST(GpuStep, LeavesTheRestStateWhereItIsToTheBit) {
  for (const auto& [solver, acceleration] : kIterations) {
    cutproof::Setup setup = setup_of(fixtures::block(9, 6, 5, 0.01), 0.004, 5);
    setup.step.solver = solver;
    setup.step.acceleration = acceleration;
    const State state = cooked(setup);
    HostLauncher launcher;
    const State reached = kernel_steps(launcher, {setup}, {state}, 5).front();
    EXPECT_EQ(reached.x, state.x);
    EXPECT_EQ(reached.v, state.v);
  }
}

TEST(GpuStep, ReproducesARigidTranslation) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    cutproof::Setup setup = setup_of(fixtures::block(6, 5, 4, 0.01));
    setup.step.solver = solver;
    State state = cooked(setup);
    const Vec3 velocity = {0.3, -0.2, 0.7};
    for (Vec3& v : state.v) v = velocity;
    const State reached = kernel_step(setup, state);
    // Displacements of at most 0.016 s · 0.7 m/s, rounded once in each of four substeps; every particle alike.
    const double rounding = 4 * kUnit * 0.0112;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      EXPECT_LE(norm(reached.x[i] - state.x[i] - 0.016 * velocity), 4 * rounding);
      EXPECT_LE(norm(reached.v[i] - velocity), 4 * rounding / 0.004);
      EXPECT_LE(norm((reached.x[i] - state.x[i]) - (reached.x[0] - state.x[0])), 1e-15);
    }
  }
}

TEST(GpuStep, ConservesLinearMomentum) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const double stiffness : {1e3, 1e5, 1e7}) {
      Random random(23);
      cutproof::Setup setup = setup_of(fixtures::block(7, 6, 5, 0.01), 0.004, 50);
      setup.step.solver = solver;
      setup.step.stiffness = stiffness;
      State state = cooked(setup);
      perturb(setup, state, random);
      state = seeded(setup, state);
      HostLauncher launcher;
      const State reached = kernel_steps(launcher, {setup}, {state}, 50).front();
      double farthest = 0;
      for (const Vec3& x : reached.x) farthest = std::max(farthest, norm(x));
      const double mass = total_mass(setup);
      const double drift = norm(momentum(setup, reached) - momentum(setup, state)) / mass;
      const double substeps = 50.0 * setup.step.substeps;
      // tolerances.md, Conservation: 0.25 n u L / dt, per mass.
      EXPECT_LE(drift, 0.25 * substeps * kUnit * farthest / 0.004) << stiffness;
      std::printf("solver %d, k %.0e: drift %.1e of the bound\n", static_cast<int>(solver), stiffness,
                  drift / (0.25 * substeps * kUnit * farthest / 0.004));
      EXPECT_EQ(norm(reached.impulse), 0) << "nothing touched it";
    }
  }
}

TEST(GpuStep, DoesNotLetErrorsOfRestCentersPushATurnedBody) {
  Random random(33);
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const double error : {0.0, 1e-3}) {
      cutproof::Setup setup = setup_of(fixtures::block(8, 5, 4, 0.01));
      setup.step.solver = solver;
      setup.step.stiffness = 1e8;
      setup.step.relaxation = 1;
      State state = cooked(setup);
      // Half a turn about the middle: R - I is as great as it can be.
      for (Vec3& x : state.x) x = {0.09 - x.x, 0.06 - x.y, x.z};
      for (Mat3& r : state.clusters.rotation) r = {{-1, 0, 0, 0, -1, 0, 0, 0, 1}};
      state = seeded(setup, state);
      for (Vec3& center : state.clusters.rest_center) center += error * 0.01 * Vec3{1, 1, 1};
      const State reached = kernel_step(setup, state);
      const double drift = norm(momentum(setup, reached) - momentum(setup, state)) / total_mass(setup);
      // Each of the S (K + 1) evaluations errs by at most a few u times 0.1 m, particle by particle at random.
      EXPECT_LE(drift, 4 * (setup.step.iterations + 1) * kUnit * 0.1 / 0.004) << error;
    }
  }
}

// Moments of rest centres that are off are taken into account: to first order, nothing depends on where these lie. (By
// a thousandth of the spacing, because what they round by is less than what the sums round by.)
TEST(GpuStep, AsksNothingOfWhereRestCentersLie) {
  Random random(34);
  for (const auto& [solver, acceleration] : kIterations) {
    cutproof::Setup setup = setup_of(fixtures::block(8, 6, 5, 0.01));
    setup.step.solver = solver;
    setup.step.acceleration = acceleration;
    State state = cooked(setup);
    perturb(setup, state, random);
    for (Vec3& x : state.x) x = {0.1 - x.y, 0.8 * x.x, x.z + 2 * x.y * x.y};
    state = seeded(setup, state);
    State expected = state;
    reference::step(setup, expected);
    for (Vec3& center : state.clusters.rest_center) center += 1e-5 * vector(random);
    const State reached = kernel_step(setup, state);
    EXPECT_LE(greatest_distance(reached.x, expected.x), frame_bound(setup, state, expected));
  }
}

TEST(GpuStep, AccountsForWhatContactsAndGripsGive) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    Random random(24);
    cutproof::Setup setup = setup_of(fixtures::block(8, 8, 6, 0.01));
    setup.step.solver = solver;
    setup.step.damping = 3;
    setup.step.gravity = {0, 1, -9.81};
    add_contacts(setup, 0.3, random);
    State state = cooked(setup);
    perturb(setup, state, random);
    state = seeded(setup, state);
    const State reached = kernel_step(setup, state);
    const double mass = total_mass(setup);
    Vec3 expected = momentum(setup, state);
    for (int s = 0; s < 4; ++s) expected = std::exp(-3 * 0.004) * (expected + 0.004 * mass * setup.step.gravity);
    expected += reached.impulse;
    EXPECT_GT(norm(reached.impulse), 0);
    // As for momentum; the body is within 0.12 m of its origin, and decay rounds what there is.
    EXPECT_LE(norm(momentum(setup, reached) - expected) / mass, 0.25 * 4 * kUnit * 0.12 / 0.004);
  }
}

// Two grips that share particles take turns: what both name goes with the one that is active, and is free in between.
TEST(GpuStep, GoesWithEachOfTheGripsThatShareAParticle) {
  for (const auto& [solver, acceleration] : kIterations) {
    Random random(35);
    cutproof::Setup setup = setup_of(fixtures::block(8, 6, 5, 0.01));
    setup.step.solver = solver;
    setup.step.acceleration = acceleration;
    setup.step.substeps = 5;
    Grip first, second;
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      if (i % 8 < 3) first.particles.push_back(i);
      if (i % 8 == 2 || i % 8 == 3) second.particles.push_back(i);
    }
    for (const bool of_first : {true, false}) {
      Grip& grip = of_first ? first : second;
      for (int s = 0; s < setup.step.substeps; ++s) {
        grip.active.push_back(of_first ? s < 2 : s > 2);
        grip.displacement.push_back(0.001 * vector(random));
      }
    }
    setup.grips = {first, second};
    State state = cooked(setup);
    perturb(setup, state, random);
    state = seeded(setup, state);
    State expected = state;
    reference::step(setup, expected);
    const State reached = kernel_step(setup, state);
    const double bound = frame_bound(setup, state, expected);
    EXPECT_LE(greatest_distance(reached.x, expected.x), bound);
    EXPECT_LE(norm(reached.impulse - expected.impulse), 2 * bound / setup.substep_length[0] * total_mass(setup));
  }
}

TEST(GpuStep, KeepsNaNInTheBodyThatHadIt) {
  Random random(25);
  cutproof::Setup setup = setup_of(fixtures::block(5, 5, 5, 0.01));
  State state = cooked(setup);
  perturb(setup, state, random);
  State poisoned = state;
  poisoned.x[7].y = std::numeric_limits<double>::quiet_NaN();
  poisoned.v[9].z = std::numeric_limits<double>::infinity();
  HostLauncher launcher;
  const auto reached = kernel_steps(launcher, {setup, setup, setup}, {state, poisoned, state});
  EXPECT_TRUE(same_bits(reached[0], kernel_step(setup, state)));
  EXPECT_TRUE(same_bits(reached[2], reached[0]));
  for (const Mat3& r : reached[1].clusters.rotation) {
    for (const double entry : r.m) EXPECT_TRUE(std::isfinite(entry));
  }
}

TEST(GpuStep, GivesABodyTheSameBitsAloneAndAmongOthersOfOtherKinds) {
  Random random(26);
  std::vector<cutproof::Setup> setups;
  std::vector<State> states;
  for (int b = 0; b < 70; ++b) {
    cutproof::Setup setup = setup_of(fixtures::block(2 + b % 5, 4, 3 + b % 3, 0.01 * (1 + b % 2)));
    setup.step.solver = b % 2 ? Solver::implicit : Solver::published;
    setup.step.substeps = 1 + b % 3;
    setup.step.iterations = b % 5;
    setup.step.gravity = {0, 0, -9.81};
    if (b % 4 == 1) add_contacts(setup, 0.2 * (b % 3), random);
    State state = cooked(setup, 2 + b % 3);
    perturb(setup, state, random);
    setups.push_back(setup);
    states.push_back(state);
  }
  HostLauncher together(HostLauncher::Threads{4});
  const auto reached = kernel_steps(together, setups, states);
  for (std::size_t b = 0; b < setups.size(); ++b) {
    EXPECT_TRUE(same_bits(reached[b], kernel_step(setups[b], states[b]))) << "body " << b;
  }
}

TEST(GpuStep, GivesTheSameBitsUnderEverySchedule) {
  Random random(27);
  cutproof::Setup setup = setup_of(fixtures::block(6, 5, 5, 0.01));
  add_contacts(setup, 0.3, random);
  State state = cooked(setup);
  perturb(setup, state, random);
  const State expected = kernel_step(setup, state);
  const auto simulated = [&](Generator schedule) {
    SimulationOptions options;
    options.schedule = std::move(schedule);
    HostLauncher launcher(options);
    return kernel_steps(launcher, {setup}, {state}).front();
  };
  EXPECT_TRUE(same_bits(simulated(forward()), expected));
  EXPECT_TRUE(same_bits(simulated(reverse()), expected));
  EXPECT_TRUE(same_bits(simulated(round_robin()), expected));
  for (uint64_t seed = 1; seed <= 3; ++seed) EXPECT_TRUE(same_bits(simulated(random_walk(seed)), expected)) << seed;
}

TEST(GpuStep, HandlesClustersOfOneTwoAndThreeParticlesAndBodiesOfNoneAndOne) {
  Random random(28);
  cutproof::Setup row = setup_of(fixtures::block(6, 1, 1, 0.01));
  cutproof::Setup one = setup_of(fixtures::block(1, 1, 1, 0.01));
  cutproof::Setup none = setup_of(fixtures::body_from_nodes({}, 0.01));
  for (cutproof::Setup* setup : {&row, &one, &none}) setup->step.gravity = {0, 0, -9.81};
  State row_state = fixtures::foreign_state(row.body, {{0}, {0, 1}, {1, 2, 3}, {3, 4}, {5}}, 1, 10);
  perturb(row, row_state, random);
  const std::vector<cutproof::Setup> setups = {none, row, one, none};
  std::vector<State> states = {cooked(none), seeded(row, row_state), cooked(one), cooked(none)};
  HostLauncher launcher;
  const auto reached = kernel_steps(launcher, setups, states);
  for (std::size_t b = 0; b < setups.size(); ++b) {
    State expected = states[b];
    reference::step(setups[b], expected);
    EXPECT_LE(greatest_distance(reached[b].x, expected.x), 1e-4 * 0.01) << "body " << b;
    EXPECT_EQ(reached[b].clusters.degenerate, expected.clusters.degenerate) << "body " << b;
  }
}

TEST(GpuStep, SumsClustersOfSizesAroundTheWidthOfAWarpAndABlock) {
  Random random(29);
  for (const int size : {31, 32, 33, 127, 128, 129, 255, 257, 1025}) {
    cutproof::Setup setup = setup_of(fixtures::block(41, 5, 5, 0.01));
    std::vector<int32_t> members;
    for (int32_t i = 0; i < size; ++i) members.push_back(i);
    State state = fixtures::foreign_state(setup.body, {members}, 1, 2000);
    perturb(setup, state, random);
    state = seeded(setup, state);
    State expected = state;
    reference::step(setup, expected);
    EXPECT_LE(greatest_distance(kernel_step(setup, state).x, expected.x), 1e-4 * 0.01) << size;
  }
}

// Groups are cells of eight particles, each a cluster too. One cluster has the first so many of them, around the number
// of lanes that share a cluster; ten have the first few, which so have more holders than are read at once.
TEST(GpuStep, SumsClustersOfManyGroupsAndGroupsOfManyHolders) {
  Random random(30);
  for (const std::size_t groups : {15u, 16u, 17u, 31u, 32u, 33u, 47u, 64u, 65u, 80u}) {
    cutproof::Setup setup = setup_of(fixtures::block(10, 8, 8, 0.01));
    std::vector<std::vector<int32_t>> clusters(80);
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      const Vec3 node = (1 / 0.02) * (setup.body.rest_position(i) - setup.body.rest_position(0));
      const auto at = [](double coordinate) { return static_cast<std::size_t>(coordinate + 0.25); };
      clusters[at(node.x) + 5 * (at(node.y) + 4 * at(node.z))].push_back(i);
    }
    const auto first = [&](std::size_t count) {
      std::vector<int32_t> members;
      for (std::size_t k = 0; k < count; ++k) members.insert(members.end(), clusters[k].begin(), clusters[k].end());
      std::sort(members.begin(), members.end());
      return members;
    };
    std::vector<std::vector<int32_t>> more = {first(groups)};
    for (std::size_t k = 0; k < 10; ++k) more.push_back(first(2 + k));
    clusters.insert(clusters.end(), more.begin(), more.end());
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      setup.step.acceleration = acceleration;
      State state = fixtures::foreign_state(setup.body, clusters, 1, 2000);
      perturb(setup, state, random);
      state = seeded(setup, state);
      State expected = state;
      reference::step(setup, expected);
      const double error = greatest_distance(kernel_step(setup, state).x, expected.x);
      EXPECT_LE(error, frame_bound(setup, state, expected)) << groups << " groups";
    }
  }
}

TEST(GpuStep, LeavesDeadParticlesAndFinishedBodiesAlone) {
  cutproof::Setup setup = setup_of(fixtures::block(4, 4, 4, 0.01));
  setup.step.gravity = {0, 0, -9.81};
  State state = fixtures::foreign_state(setup.body, {{1, 2, 3}}, 1, 10);
  state.alive[0] = 0;
  state.removed = {0};
  state.v[0] = {1, 2, 3};
  const State reached = kernel_step(setup, state);
  EXPECT_EQ(reached.x[0], state.x[0]);
  EXPECT_EQ(reached.v[0], state.v[0]);
  EXPECT_TRUE(reached.removed.empty()) << "a frame begins with nothing removed";
  const std::vector<cutproof::Setup> setups = {setup};
  const std::vector<State> states = {state};
  StagingBuffers staging = make_staging_buffers(setups, states, Capacity{});
  EXPECT_GE(staging.cut[0], 0);
  HostLauncher launcher;
  enqueue_step(launcher, staging.view(), make_plan(setups, states), Span{Stage::step, Stage::step});
  EXPECT_EQ(staging.cut[0], -1) << "so that no cluster stage runs";
  State finished = state;
  finished.frame = 1;
  const State after = kernel_step(setup, finished);
  EXPECT_EQ(after.x, state.x);
  EXPECT_EQ(after.removed, state.removed);
}

TEST(GpuStep, KeepsItsAccuracyInABodyOfAHundredSpacings) {
  Random random(30);
  cutproof::Setup setup = setup_of(fixtures::block(100, 3, 3, 0.01));
  add_contacts(setup, 0.2, random);
  setup.blade_moves.clear();
  setup.has_blade = false;
  // Pressed against a wall at the far end, and turned and bent as a whole.
  setup.walls = {{0, -1, 0.99, 0.3}};
  State state = cooked(setup);
  for (Vec3& x : state.x) {
    const double angle = 0.3 * x.x;
    x = {x.x, std::cos(angle) * x.y - std::sin(angle) * x.z, std::sin(angle) * x.y + std::cos(angle) * x.z};
  }
  perturb(setup, state, random);
  state = seeded(setup, state);
  State expected = state;
  reference::step(setup, expected);
  const double error = greatest_distance(kernel_step(setup, state).x, expected.x);
  std::printf("greatest error: %.1e h\n", error / 0.01);
  EXPECT_LE(error, 1e-4 * 0.01);
}

TEST(GpuStep, BringsInvertedAndFlattenedBodiesBackWithoutNaN) {
  for (const double factor : {-1.0, 0.0, 1e-9}) {
    cutproof::Setup setup = setup_of(fixtures::block(4, 4, 4, 0.01), 0.004, 60);
    setup.step.stiffness = 1e6;
    setup.step.damping = 5;
    State state = cooked(setup);
    for (Vec3& x : state.x) x.z = 0.025 + factor * (x.z - 0.025);
    HostLauncher launcher;
    const State reached = kernel_steps(launcher, {setup}, {state}, 60).front();
    for (const Vec3& x : reached.x) ASSERT_TRUE(is_finite(x)) << factor;
    for (const Mat3& r : reached.clusters.rotation) {
      const Vec3 a = {r(0, 0), r(1, 0), r(2, 0)}, b = {r(0, 1), r(1, 1), r(2, 1)}, c = {r(0, 2), r(1, 2), r(2, 2)};
      EXPECT_NEAR(dot(cross(a, b), c), 1, 5e-6);
    }
  }
}

TEST(Layout, FindsCoordinatesOfNodesOfEveryGrid) {
  Random random(32);
  for (const int divisor : {1, 2, 3, 5, 7, 64, 65, 641, 46341, 65535, 65536, 0x3fffffff, 0x40000001, 0x7fffffff}) {
    const Divider by = divider_of(divisor);
    for (int trial = 0; trial < 1000; ++trial) {
      const int multiple = static_cast<int>(uniform(random, 0, 0x7fffffff / divisor)) * divisor;
      for (const int n : {multiple, std::max(0, multiple - 1), multiple / 2, 0x7fffffff}) {
        ASSERT_EQ(n / by, n / divisor) << n << " / " << divisor;
      }
    }
  }
}

TEST(GpuStep, ShrinksVelocitiesByTheExponential) {
  EXPECT_EQ(step_detail::decay_by(0), 1);
  EXPECT_EQ(step_detail::decay_by(1000), 0);
  double worst = 0;
  for (double x = 1e-6; x < 86; x *= 1.01) {
    const auto given = static_cast<float>(x);
    worst = std::max(worst, std::abs(step_detail::decay_by(given) / std::exp(-double{given}) - 1));
  }
  EXPECT_LE(worst, 4 * kUnit);
}

TEST(GpuContacts, ProjectWhereTheReferenceDoes) {
  Random random(31);
  int moved = 0, far_apart = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    cutproof::Setup setup = setup_of(fixtures::body_from_nodes({{0, 0, 0}, {19, 0, 0}, {0, 19, 0}, {10, 10, 3}}, 1.0));
    setup.step.substeps = 1;
    add_contacts(setup, trial % 2 ? 0.4 : 0.0, random);
    if (trial % 5 == 0) setup.walls.clear();
    if (trial % 7 == 0) setup.blade_moves[0].down = false;
    const BladeMove& move = setup.blade_moves[0];
    const std::vector<cutproof::Setup> setups = {setup};
    const std::vector<State> states = {fixtures::foreign_state(setup.body, {{0}}, 1, 1)};
    StagingBuffers staging = make_staging_buffers(setups, states, Capacity{});
    const DeviceView view = staging.view();
    const auto p = static_cast<int32_t>(uniform(random, 0, setup.body.particle_count()));
    const Vec3 rest = setup.body.rest_position(p);
    const auto near_blade = [&] {
      return Vec3{move.from.edge.x + 3 * normal(random), move.from.edge.y + normal(random),
                  move.from.edge.z + 3 * normal(random)};
    };
    const auto single = [](Vec3 v) {
      return Float3{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    };
    const Float3 start = single(near_blade() - rest), wanted = single(near_blade() - rest);
    const auto place = [&](Float3 d) { return rest + Vec3{d.x, d.y, d.z}; };

    const reference::Contacts expected(setup, move.down ? &move : nullptr);
    const Pace pace = step_detail::pace_of(view, 0);
    const Contacts contacts = contacts_of(view, pace, 0);
    EXPECT_EQ(contacts.frictionless, expected.frictionless());
    const RestPoint at = {pace.h, step_detail::grid_node(pace, view.node[p])};
    const float side = blade_side(contacts, at, start);
    EXPECT_EQ(side, expected.side(place(start)));
    bool in_turn = false;
    const Vec3 reached = place(project(contacts, at, wanted, side, start, in_turn));
    const Vec3 reference = expected.project_with_friction(place(wanted), static_cast<int>(side), place(start));
    moved += norm(reached - place(wanted)) > 1e-3;
    // Coordinates of up to 30 h, rounded a few times; friction divides by the length of a contact's push.
    if (norm(reached - reference) > 100 * kUnit * 30) ++far_apart;
  }
  EXPECT_GT(moved, 1500);
  // Where two ways out are equally long, or a push is as short as its rounding, either answer is right.
  EXPECT_LE(far_apart, 4);
}

// A blade that stands obliquely 16 h from where the one particle rests: displacements are rounded by 2^-20 h there.
constexpr RestPoint kOrigin = {1, {0, 0, 0}};
constexpr PoseF kOblique = {{0, 0, 16}, {0, 1, 0}, {-0.8f, 0, 0.6f}, {0.6f, 0, 0.8f}};
constexpr MoveF kResting = {kOblique, kOblique, 1};
Float3 beside_oblique(float along, float back, float height) {
  return kOblique.edge + along * kOblique.along + back * kOblique.back + height * kOblique.normal;
}

TEST(GpuContacts, RubAlongThePlateHoweverShortThePush) {
  Random random(32);
  const Contacts contacts = {nullptr, 0, &kResting, 4, 6, 0.25f, 1024, false};
  int pressed = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    // A few roundings deep, and a friction that holds fast whatever slides a quarter of its reach.
    const auto push = static_cast<float>(uniform(random, 2, 6)) * 0x1p-20f;
    const Float3 wanted = beside_oblique(static_cast<float>(uniform(random, -3, 3)),
                                         static_cast<float>(uniform(random, 0.5, 5)), contacts.clearance - push);
    const double angle = uniform(random, 0, 6.28);
    const float slid = 0.25f * contacts.blade_friction * push;
    const Float3 slide = slid * (static_cast<float>(std::cos(angle)) * kOblique.along +
                                 static_cast<float>(std::sin(angle)) * kOblique.back);
    const Float3 start = wanted - slide;
    if (dot(wanted - kOblique.edge, kOblique.normal) > contacts.clearance - 0x1p-20f) continue;  // rounded out of it
    ++pressed;
    bool in_turn = false;
    const Float3 gone = project(contacts, kOrigin, wanted, 1, start, in_turn) - start;
    EXPECT_LE(std::hypot(dot(gone, kOblique.along), dot(gone, kOblique.back)), 8 * 0x1p-20f) << "trial " << trial;
  }
  EXPECT_GT(pressed, 800);
}

TEST(GpuContacts, RefuseAPlaceThatIsWorseBeyondItsMarginAndNoOther) {
  Random random(33);
  const auto farther = [](float distance, float of_x, double roundings) {
    return static_cast<float>(roundings * kUnit * (double{distance} + of_x));
  };
  int in_turn_count = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const WallF wall = {2, -1, 16.5f, 0};  // keeps the particle under it, as the blade does
    const Contacts contacts = {&wall, 1, &kResting, 4, 6, 0.25f, 0, true};
    const Float3 free =
        beside_oblique(static_cast<float>(uniform(random, -3, 3)), static_cast<float>(uniform(random, 0.5, 2)), -1);
    bool in_turn = false;
    const Float3 next = project(contacts, kOrigin, free, 1, free, in_turn);
    const float distance = norm(next - free);
    if (!in_turn || distance == 0) continue;
    ++in_turn_count;
    // Places a little nearer to `free` than the next one, by half and by twice the margin.
    for (const double share : {0.5, 2.0}) {
      const float nearer = farther(distance, norm(next), share * kRefusalRoundings);
      const Float3 x = next + (nearer / distance) * (free - next);
      const Float3 taken = next_position(contacts, kOrigin, free, 1, free, x);
      EXPECT_EQ(norm(taken - next) == 0, share < 1) << "trial " << trial;
      EXPECT_EQ(norm(taken - x) == 0, share > 1) << "trial " << trial;
    }
  }
  EXPECT_GT(in_turn_count, 300);
}

}  // namespace
}  // namespace cutproof::gpu::step_kernel_test
