// Detection on the kernels (gpu/kernels/detect.cuh) against the reference, outside the rounding bands that detect.cuh
// states, and against the definition where a closed form is at hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/host/host_launcher.h"
#include "gpu/kernels/detect.cuh"
#include "gpu/state/staging.h"
#include "model/at.h"
#include "reference_cpu/carrier.h"
#include "reference_cpu/reference.h"

namespace cutproof::gpu::detect_kernel_test {
namespace {

using Random = std::mt19937_64;
constexpr double kUnit = 0x1p-24;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 vector(Random& random) {
  std::normal_distribution<double> normal;
  return {normal(random), normal(random), normal(random)};
}

Setup setup_of(Body body, Criterion criterion, int64_t frames = 1) {
  cutproof::Setup setup;
  setup.body = std::move(body);
  setup.step.substeps = 1;
  setup.substep_length.assign(at(frames), 0.01);
  setup.detect.criterion = criterion;
  setup.detect.without_blade = true;
  return setup;
}

State cooked(const Setup& setup) { return fixtures::cook(setup.body, {}, setup.expand, setup.merge, 1); }

// The state with the positions that single precision keeps, so that both sides judge the same numbers.
State kept(const Setup& setup, State state) {
  const StagingBuffers staging = make_staging_buffers({setup}, {state}, Capacity{});
  state.x = extract_states(staging, {setup}).front().x;
  return state;
}

std::vector<State> detected(const std::vector<Setup>& setups, const std::vector<State>& states, HostLauncher& launcher,
                            Counters* counters = nullptr) {
  StagingBuffers staging = make_staging_buffers(setups, states, Capacity{});
  enqueue_detect(launcher, staging.view(), make_plan(setups, states));
  if (counters != nullptr) *counters = staging.counters.front();
  return extract_states(staging, setups);
}
State detected(const Setup& setup, const State& state) {
  HostLauncher launcher;
  return detected({setup}, {state}, launcher).front();
}

// What the reference backend does with a body in its detect span.
State expected(const Setup& setup, State state) {
  if (state.frame < setup.frame_count() && needs_detection(setup)) reference::detect(setup, state);
  return state;
}

double greatest_neighbour_distance(const Body& body, const State& state, int32_t i) {
  double greatest = 0;
  for (int direction = 0; direction < 6; ++direction) {
    const int32_t j = body.neighbour(i, direction);
    if (j >= 0 && state.alive[at(j)]) greatest = std::max(greatest, norm(state.x[at(i)] - state.x[at(j)]));
  }
  return greatest;
}

// Of a spacing of its own for each b in 0 .. 4.
Body some_block(Random& random, int b) {
  const double h = std::vector<double>{1.0, 0.1, 0.0037, 1.0 / 3, 17.0}[at(b)];
  return fixtures::block(2 + static_cast<int32_t>(random() % 6), 1 + static_cast<int32_t>(random() % 5), 4, h);
}

// ---- Distance

// The band of detect.cuh.
bool is_undecidable(const Setup& setup, const State& state, int32_t i) {
  const double h = setup.body.grid.spacing, epsilon = setup.detect.epsilon;
  const double distance = greatest_neighbour_distance(setup.body, state, i);
  return std::abs(distance - epsilon * h) <= 8 * kUnit * (1 + epsilon) * h;
}

TEST(GpuDetectByDistance, EqualsTheReferenceOutsideItsBandForManyBodiesInOneLoad) {
  Random random(1);
  int64_t removed = 0, stayed = 0, undecidable = 0;
  for (int round = 0; round < 20; ++round) {
    std::vector<cutproof::Setup> setups;
    std::vector<State> states;
    for (int b = 0; b < 5; ++b) {
      Body body = some_block(random, b);
      const double h = body.grid.spacing;
      cutproof::Setup setup = setup_of(std::move(body), Criterion::distance, 3);
      setup.detect.epsilon = uniform(random, 1.1, 2.5);
      setup.detect.without_blade = random() % 6 != 0;  // without: no detection
      State state = cooked(setup);
      const Vec3 far = (random() % 2 ? 100 * h : 0.0) * vector(random);
      for (Vec3& x : state.x) x += 0.3 * h * vector(random) + far;
      for (uint8_t& alive : state.alive) alive = random() % 10 != 0;
      state.frame = random() % 5 == 0 ? 3 : static_cast<int64_t>(random() % 3);  // 3: its schedule is over
      setups.push_back(setup);
      states.push_back(kept(setup, state));
    }
    HostLauncher launcher(HostLauncher::Threads{round % 3 + 1});
    Counters counters{};
    const std::vector<State> actual = detected(setups, states, launcher, &counters);
    int64_t listed = 0;
    for (std::size_t b = 0; b < setups.size(); ++b) {
      const State exact = expected(setups[b], states[b]);
      listed += static_cast<int64_t>(actual[b].removed.size());
      std::vector<int32_t> gone;
      for (int32_t i = 0; i < setups[b].body.particle_count(); ++i) {
        if (states[b].alive[at(i)] && !actual[b].alive[at(i)]) gone.push_back(i);
        if (is_undecidable(setups[b], states[b], i)) {
          ++undecidable;
          continue;
        }
        ASSERT_EQ(actual[b].alive[at(i)], exact.alive[at(i)]) << "round " << round << ", body " << b << ", " << i;
        ++(exact.alive[at(i)] ? stayed : removed);
      }
      EXPECT_EQ(actual[b].removed, gone);
    }
    EXPECT_EQ(counters.removed, listed);
  }
  EXPECT_GT(removed, 500);
  EXPECT_GT(stayed, 500);
  EXPECT_LT(undecidable, 5);
}

// A wire whose edges are within a few units in the last place of the limit, in all directions.
TEST(GpuDetectByDistance, DecidesForBothEndsOfAnEdgeAlikeHoweverNearTheLimitItIs) {
  Random random(2);
  int both = 0, none = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const int axis = static_cast<int>(random() % 3);
    const double h = uniform(random, 0.001, 2);
    cutproof::Setup setup =
        setup_of(fixtures::block(axis == 0 ? 2 : 1, axis == 1 ? 2 : 1, axis == 2 ? 2 : 1, h), Criterion::distance);
    State state = cooked(setup);
    const double length = 1.5 * h * (1 + uniform(random, -2, 2) * kUnit);
    const Vec3 edge = length * normalized(vector(random)), far = 10 * h * vector(random);
    state.x[0] += far;
    state.x[1] = state.x[0] + edge;
    const State after = detected(setup, state);
    ASSERT_EQ(after.alive[0], after.alive[1]) << "trial " << trial;
    ++(after.alive[0] ? none : both);
  }
  EXPECT_GT(both, 500);
  EXPECT_GT(none, 500);
}

TEST(GpuDetectByDistance, KeepsAnEdgeOfExactlyTheLimitAndIgnoresDeadNeighbours) {
  const cutproof::Setup setup = setup_of(fixtures::block(3, 1, 1, 1.0), Criterion::distance);
  State state = cooked(setup);
  state.x[2].x += 0.5;
  EXPECT_TRUE(detected(setup, state).removed.empty());
  state.x[2].x += 1e-6;
  EXPECT_EQ(detected(setup, state).removed, (std::vector<int32_t>{1, 2}));
  state.alive[1] = 0;
  EXPECT_TRUE(detected(setup, state).removed.empty());
}

TEST(GpuDetectByDistance, IsNotMovedByWhereABodyOfManySpacingsIs) {
  // Displacements are stored, so a far end is as exact as a near one.
  const cutproof::Setup setup = setup_of(fixtures::block(400, 1, 1, 0.1), Criterion::distance);
  State state = cooked(setup);
  for (const std::size_t i : {10u, 200u, 398u}) {
    state = cooked(setup);
    for (std::size_t j = i + 1; j < state.x.size(); ++j) state.x[j].x += 0.05 * (1 + 1e-5);
    EXPECT_EQ(detected(setup, state).removed,
              (std::vector<int32_t>{static_cast<int32_t>(i), static_cast<int32_t>(i) + 1}));
  }
}

TEST(GpuDetectByDistance, HandlesParticleCountsAroundWarpsAndBlocks) {
  for (const int32_t n : {0, 1, 2, 31, 32, 33, 255, 256, 257, 1023, 1024, 1025}) {
    std::vector<std::array<int32_t, 3>> nodes;
    for (int32_t i = 0; i < n; ++i) nodes.push_back({i, 0, 0});
    const cutproof::Setup setup = setup_of(fixtures::body_from_nodes(nodes, 1.0), Criterion::distance);
    State state = cooked(setup);
    for (int32_t i = 0; i < n; ++i) state.x[at(i)].x *= i % 2 ? 1 : 1 + 1e-3 * i;
    state = kept(setup, state);
    const State exact = expected(setup, state);
    EXPECT_EQ(detected(setup, state).removed, exact.removed) << n << " particles";
  }
}

// ---- One end of each edge

// Within the bands of detect.cuh: whether an edge at the particle or at a neighbour is open, on which side of the
// blade's plane the ends of its own are, and which of them the clusters carry nearer to it.
bool is_undecidable_of_one(const Setup& setup, const State& state, int32_t i) {
  const double h = setup.body.grid.spacing, epsilon = setup.detect.epsilon;
  const BladePose& pose = setup.blade_moves[0].to;
  std::vector<int32_t> near = {i};
  for (const int32_t j : setup.body.neighbours(i)) {
    if (state.alive[at(j)]) near.push_back(j);
  }
  const reference::Carrier carried(setup, state);
  for (const int32_t j : near) {
    const Vec3 here = carried(i), there = carried(j);
    const auto height = [&](Vec3 x) { return std::abs(dot(x - pose.edge, cross(pose.along, pose.back))); };
    const double lead = std::abs(height(here) - height(there)) - kNearerBy * h;
    if (std::abs(lead) <= 64 * kUnit * (norm(here) + norm(there) + norm(pose.edge) + h)) return true;
    const double n = dot(state.x[at(j)] - pose.edge, cross(pose.along, pose.back));
    if (std::abs(n) <= kUnit * (10 * norm(state.x[at(j)]) + 8 * norm(pose.edge))) return true;
    for (const int32_t k : setup.body.neighbours(j)) {
      const double distance = norm(state.x[at(j)] - state.x[at(k)]);
      if (state.alive[at(k)] && std::abs(distance - epsilon * h) <= 8 * kUnit * (1 + epsilon) * h) return true;
    }
  }
  return false;
}

TEST(GpuDetectOneEnd, EqualsTheReferenceOutsideItsBandForManyBodiesInOneLoad) {
  Random random(7);
  int64_t removed = 0, stayed = 0, undecidable = 0, by_blade = 0;
  for (int round = 0; round < 30; ++round) {
    std::vector<cutproof::Setup> setups;
    std::vector<State> states;
    for (int b = 0; b < 5; ++b) {
      Body body = some_block(random, b);
      const double h = body.grid.spacing;
      cutproof::Setup setup = setup_of(std::move(body), Criterion::distance, 3);
      setup.detect.remove = b == 2 ? RemovedEnds::both : b % 2 == 0 ? RemovedEnds::one : RemovedEnds::nearer;
      setup.detect.epsilon = uniform(random, 1.1, 1.8);
      setup.step.substeps = 2;
      setup.has_blade = random() % 4 != 0;
      setup.blade = {h, h, 0, 0};
      for (int s = 0; s < 6; ++s) {
        BladePose pose = {h * Vec3{uniform(random, 1, 6), uniform(random, 1, 4), uniform(random, 1, 4)}, {}, {}};
        pose.along = normalized(vector(random));
        pose.back = normalized(cross(pose.along, vector(random)));
        // The last of a frame that is down counts, here the first of its two.
        setup.blade_moves.push_back({pose, pose, s % 2 == 0 && random() % 3 != 0, 0});
      }
      State state = cooked(setup);
      for (Vec3& x : state.x) x += 0.25 * h * vector(random);
      for (uint8_t& alive : state.alive) alive = random() % 10 != 0;
      state.frame = random() % 5 == 0 ? 3 : 0;  // 3: its schedule is over
      setups.push_back(setup);
      states.push_back(kept(setup, state));
    }
    HostLauncher launcher(HostLauncher::Threads{round % 3 + 1});
    const std::vector<State> actual = detected(setups, states, launcher);
    for (std::size_t b = 0; b < setups.size(); ++b) {
      const State exact = expected(setups[b], states[b]);
      cutproof::Setup without = setups[b];
      for (BladeMove& move : without.blade_moves) move.down = false;
      const State as_if_up = expected(without, states[b]);
      for (int32_t i = 0; i < setups[b].body.particle_count(); ++i) {
        if (is_undecidable_of_one(setups[b], states[b], i)) {
          ++undecidable;
          continue;
        }
        ASSERT_EQ(actual[b].alive[at(i)], exact.alive[at(i)]) << "round " << round << ", body " << b << ", " << i;
        ++(exact.alive[at(i)] ? stayed : removed);
        by_blade += exact.alive[at(i)] != as_if_up.alive[at(i)];
      }
    }
  }
  EXPECT_GT(removed, 500);
  EXPECT_GT(stayed, 500);
  EXPECT_GT(by_blade, 50);
  EXPECT_LT(undecidable, 20);
}

// Both ends judge an edge at the limit, and the side of an end in the plane, alike: one of them goes, or none.
TEST(GpuDetectOneEnd, TakesExactlyOneEndHoweverNearTheLimitOrThePlaneItIs) {
  Random random(8);
  int one = 0, none = 0, higher = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const double h = uniform(random, 0.001, 2);
    cutproof::Setup setup = setup_of(fixtures::block(2, 1, 1, h), Criterion::distance);
    setup.detect.remove = trial % 3 == 0 ? RemovedEnds::nearer : RemovedEnds::one;
    State state = cooked(setup);
    const double length = (trial % 2 ? 1.5 * (1 + uniform(random, -2, 2) * kUnit) : 2) * h;
    state.x[0] += 10 * h * vector(random);
    state.x[1] = state.x[0] + length * normalized(vector(random));
    BladePose pose = {state.x[1], normalized(vector(random)), {}};
    pose.back = normalized(cross(pose.along, vector(random)));
    pose.edge += (uniform(random, -2, 2) * kUnit * h) * vector(random);
    setup.has_blade = true;
    setup.blade = {h, h, 0, 0};
    setup.blade_moves = {{pose, pose, true, 0}};
    const State after = detected(setup, state);
    ASSERT_TRUE(after.alive[0] || after.alive[1]) << "trial " << trial;
    const bool went = !after.alive[0] || !after.alive[1];
    ASSERT_TRUE(went || trial % 2 == 1) << "trial " << trial;
    ++(went ? one : none);
    higher += !after.alive[1];
  }
  EXPECT_GT(one, 2500);
  EXPECT_GT(none, 500);
  EXPECT_GT(higher, 500);
}

TEST(GpuDetect, ReplacesTheListWhenItRunsTwiceInAFrame) {
  const cutproof::Setup setup = setup_of(fixtures::block(8, 1, 1, 1.0), Criterion::distance);
  State state = cooked(setup);
  for (std::size_t i = 4; i < 8; ++i) state.x[i].x += 1;
  StagingBuffers staging = make_staging_buffers({setup}, {state}, Capacity{});
  const Plan plan = make_plan({setup}, {state});
  HostLauncher launcher;
  const auto again = [&] {
    enqueue_detect(launcher, staging.view(), plan);
    return extract_states(staging, {setup}).front();
  };
  EXPECT_EQ(again().removed, (std::vector<int32_t>{3, 4}));
  EXPECT_TRUE(again().removed.empty());
  EXPECT_EQ(staging.cut[0], -1);
  EXPECT_EQ(staging.counters[0].removed, 0);
  staging.displacement[7].x += 1;
  EXPECT_EQ(again().removed, (std::vector<int32_t>{6, 7}));
  EXPECT_EQ(again().alive, (std::vector<uint8_t>{1, 1, 1, 0, 0, 1, 0, 0}));
}

// ---- Geometric

void sweep(Setup& setup, BladePose from, BladePose to, double length, double depth, double thickness) {
  setup.has_blade = true;
  setup.blade = {length, depth, thickness, 0};
  setup.blade_moves = {{from, to, true, 0}};
}

double distance_to_rectangle(const Blade& blade, const BladePose& pose, Vec3 x) {
  const double u = std::clamp(dot(x - pose.edge, pose.along), -blade.length / 2, blade.length / 2);
  const double w = std::clamp(dot(x - pose.edge, pose.back), 0.0, blade.depth);
  return norm(x - pose.edge - u * pose.along - w * pose.back);
}

// Along a translation the distance is a convex function of time.
double distance_to_translated(const Blade& blade, const BladePose& from, const BladePose& to, Vec3 x) {
  const auto f = [&](double t) {
    BladePose pose = from;
    pose.edge += t * (to.edge - from.edge);
    return distance_to_rectangle(blade, pose, x);
  };
  double low = 0, high = 1;
  for (int k = 0; k < 120; ++k) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (f(a) <= f(b) ? high : low) = f(a) <= f(b) ? b : a;
  }
  return std::min({f(0), f(1), f((low + high) / 2)});
}

// The blade as single precision stores it.
BladePose rounded(BladePose pose) {
  for (Vec3* v : {&pose.edge, &pose.along, &pose.back}) {
    for (int k = 0; k < 3; ++k) (*v)[k] = static_cast<float>((*v)[k]);
  }
  return pose;
}

BladePose random_pose(Random& random, Vec3 edge) {
  const Vec3 along = normalized(vector(random));
  const Vec3 other = vector(random);
  return {edge, along, normalized(other - dot(other, along) * along)};
}

TEST(GpuDetectGeometric, TakesWhatATranslatedBladeComesNearAndNothingBeyondItsSlack) {
  Random random(3);
  int removed = 0, stayed = 0, undecidable = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const double h = trial % 2 ? 1.0 : 0.013;
    cutproof::Setup setup = setup_of(fixtures::block(9, 8, 7, h), Criterion::geometric);
    State state = cooked(setup);
    if (trial % 3 == 0) {
      for (Vec3& x : state.x) x += 0.2 * h * vector(random);  // stretched tissue has a longer reach
    }
    state = kept(setup, state);
    const Vec3 middle = {4 * h, 4 * h, 4 * h};
    BladePose from = random_pose(random, middle + 3 * h * vector(random));
    BladePose to = from;
    to.edge += 3 * h * vector(random);
    if (trial % 5 == 0) to.edge = from.edge;
    if (trial % 5 == 1) to.edge = from.edge + 4 * h * from.along;  // the edge slides in itself
    if (trial % 5 == 2) to.edge = from.edge - 3 * h * from.back;
    from = rounded(from);
    to = rounded(to);
    sweep(setup, from, to, h * uniform(random, 0.1, 9), h * uniform(random, 0.1, 9), h * uniform(random, 0, 2));
    const State after = detected(setup, state), exact = expected(setup, state);
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      const double longest = std::max({h, setup.blade.thickness, greatest_neighbour_distance(setup.body, state, i)});
      const double reach = longest / 2;
      const double distance = distance_to_translated(setup.blade, from, to, state.x[at(i)]);
      const double slack = 16 * kUnit * reach + 12 * kUnit * (norm(state.x[at(i)]) + norm(from.edge));
      if (distance > reach && distance <= reach + 2 * slack) {
        ++undecidable;
        continue;
      }
      ASSERT_EQ(after.alive[at(i)] == 0, distance <= reach) << "trial " << trial << ", " << i << ", " << distance / h;
      ASSERT_EQ(after.alive[at(i)], exact.alive[at(i)]) << "trial " << trial << ", " << i << ", " << distance / h;
      ++(after.alive[at(i)] ? stayed : removed);
    }
  }
  EXPECT_GT(removed, 3000);
  EXPECT_GT(stayed, 5000);
  EXPECT_LT(undecidable, 5);
}

TEST(GpuDetectGeometric, TakesWhatATurningBladeComesNearAndNothingBeyondAFewHundredthsOfASpacing) {
  Random random(4);
  int removed = 0, stayed = 0;
  for (int trial = 0; trial < 42; ++trial) {
    cutproof::Setup setup = setup_of(fixtures::block(7, 7, 7, 1.0), Criterion::geometric);
    const State state = cooked(setup);
    const BladePose from = random_pose(random, Vec3{4, 4, 4} + 2 * vector(random));
    const Vec3 axis = trial % 3 == 0 ? from.back : normalized(vector(random));
    const double half_turn = 3.14159265358979;
    const double angle = trial % 7 == 0 ? half_turn : trial % 7 == 1 ? 1e-4 : uniform(random, 0, trial % 2 ? 0.3 : 3.0);
    const auto turned = [&](Vec3 v, double a) {
      return std::cos(a) * v + std::sin(a) * cross(axis, v) + (1 - std::cos(a)) * dot(axis, v) * axis;
    };
    const Vec3 way = trial % 5 == 0 ? Vec3{} : 2 * vector(random);
    const auto pose = [&](double t) {
      return BladePose{from.edge + t * way, turned(from.along, t * angle), turned(from.back, t * angle)};
    };
    sweep(setup, from, pose(1), uniform(random, 1, 6), uniform(random, 1, 6), uniform(random, 0, 2));
    const State after = detected(setup, state);
    const double reach = std::max(setup.blade.thickness, 1.0) / 2;
    constexpr int kSamples = 1500;
    const double radius = std::hypot(setup.blade.length / 2, setup.blade.depth);
    const double band = (norm(way) + radius * angle) / kSamples + 1e-5;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      double distance = 1e300;
      for (int k = 0; k <= kSamples; ++k) {
        distance = std::min(distance, distance_to_rectangle(setup.blade, pose(double(k) / kSamples), state.x[i]));
      }
      // Half a turn may go either way round.
      if (angle == half_turn) {
        if (distance > reach - band) continue;
        double other = 1e300;
        for (int k = 0; k <= kSamples; ++k) {
          const double t = double(k) / kSamples;
          const BladePose back = {from.edge + t * way, turned(from.along, -t * angle), turned(from.back, -t * angle)};
          other = std::min(other, distance_to_rectangle(setup.blade, back, state.x[i]));
        }
        if (other > reach - band) continue;
        ASSERT_EQ(after.alive[i], 0) << "trial " << trial << ", " << i;
        continue;
      }
      if (distance <= reach - band) {
        ASSERT_EQ(after.alive[i], 0) << "trial " << trial << ", particle " << i << ", " << distance - reach;
        ++removed;
      } else if (distance > reach + 2 * 0.04 + band) {
        // Once for the part's own slack, once for how far the true sweep is from its translation.
        ASSERT_EQ(after.alive[i], 1) << "trial " << trial << ", particle " << i << ", " << distance - reach;
        ++stayed;
      }
    }
  }
  EXPECT_GT(removed, 1000);
  EXPECT_GT(stayed, 1000);
}

TEST(GpuDetectGeometric, TakesBothLayersWhenTheBladeIsHalfwayBetweenThem) {
  for (const double h : {0.1, 1.0 / 3, 0.0137, 1.0, 0.7}) {
    for (const int axis : {0, 1, 2}) {
      cutproof::Setup setup = setup_of(
          fixtures::block(axis == 0 ? 150 : 2, axis == 1 ? 150 : 2, axis == 2 ? 150 : 2, h), Criterion::geometric);
      const State state = cooked(setup);
      for (int layer = 1; layer < 150; layer += 7) {
        BladePose pose;
        pose.edge[axis] = h * (layer + 0.5);
        pose.along = axis == 0 ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
        pose.back = axis == 2 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
        sweep(setup, pose, pose, 20 * h, 10 * h, layer % 2 ? 0 : h);
        ASSERT_EQ(detected(setup, state).removed.size(), 8u) << "h " << h << ", axis " << axis << ", layer " << layer;
      }
    }
  }
}

TEST(GpuDetectGeometric, AThinBladeOfAnyPlaneSeparatesWhateverEdgeItCrossesInStretchedTissueToo) {
  Random random(5);
  int64_t crossed = 0;
  for (int trial = 0; trial < 100; ++trial) {
    cutproof::Setup setup = setup_of(fixtures::block(6, 6, 6, 0.1), Criterion::geometric);
    State state = cooked(setup);
    if (trial % 2) {
      for (Vec3& x : state.x) x = {1.7 * x.x + 0.3 * x.y, x.y, 0.8 * x.z};
    }
    const Vec3 n = normalized(vector(random));
    const Vec3 along = normalized(cross(n, std::abs(n.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const Vec3 back = cross(n, along);
    const Vec3 middle = Vec3{0.35, 0.35, 0.35} + 0.1 * vector(random);
    const BladePose pose = {middle - 2 * back, along, back};
    sweep(setup, pose, pose, 4, 4, 0.0);
    const State after = detected(setup, state);
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      for (const int direction : {0, 2, 4}) {
        const int32_t j = setup.body.neighbour(i, direction);
        if (j < 0 || dot(state.x[at(i)] - middle, n) * dot(state.x[at(j)] - middle, n) >= 0) continue;
        ++crossed;
        EXPECT_FALSE(after.alive[at(i)] && after.alive[at(j)]) << "trial " << trial << ", edge " << i << "-" << j;
      }
    }
  }
  EXPECT_GT(crossed, 2000);
}

TEST(GpuDetectGeometric, SweepsEverySubstepOfItsOwnFrameInWhichTheBladeIsDown) {
  cutproof::Setup setup = setup_of(fixtures::block(12, 1, 1, 1.0), Criterion::geometric, 3);
  setup.step.substeps = 2;
  const auto move = [](double x, bool down) {
    const BladePose pose = {{x, 1, 0}, {0, 1, 0}, {0, 0, 1}};
    return BladeMove{pose, pose, down, 0};
  };
  sweep(setup, {}, {}, 2, 2, 0);
  setup.blade_moves = {move(1, true), move(2, true), move(5, true), move(7, true), move(9, true), move(11, false)};
  State state = cooked(setup);
  const std::vector<std::vector<int32_t>> gone = {{0, 1}, {4, 6}, {8}, {}};
  for (int64_t f = 0; f < 4; ++f) {
    state.frame = f;  // frame 3: the schedule is over
    EXPECT_EQ(detected(setup, state).removed, gone[at(f)]) << "frame " << f;
  }
  setup.has_blade = false;
  state.frame = 0;
  EXPECT_TRUE(detected(setup, state).removed.empty());
}

// ---- Strain

TEST(GpuDetectByStrain, EqualsTheReferenceAwayFromTheThreshold) {
  Random random(6);
  int64_t removed = 0, stayed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int32_t thin = static_cast<int32_t>(random() % 3);
    cutproof::Setup setup = setup_of(
        fixtures::block(trial % 4 == 3 ? 1 : 7, thin == 0 ? 1 : 6, thin == 1 ? 1 : 5, 0.01), Criterion::strain);
    State state = cooked(setup);
    const Vec3 axis = normalized(vector(random));
    const double angle = uniform(random, 0, 3), stretch = uniform(random, 0.9, 1.4);
    const Vec3 direction = normalized(vector(random)), far = 0.5 * vector(random);
    for (Vec3& x : state.x) {
      x += (stretch - 1) * dot(x, direction) * direction + 2e-4 * vector(random);
      x = std::cos(angle) * x + std::sin(angle) * cross(axis, x) + (1 - std::cos(angle)) * dot(axis, x) * axis + far;
    }
    state = kept(setup, state);
    const State after = detected(setup, state);
    cutproof::Setup low = setup, high = setup;
    low.detect.strain *= 1 - 2e-5;
    high.detect.strain *= 1 + 2e-5;
    const State more = expected(low, state), less = expected(high, state);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (more.alive[i] != less.alive[i]) continue;
      ASSERT_EQ(after.alive[i], more.alive[i]) << "trial " << trial << ", particle " << i;
      ++(after.alive[i] ? stayed : removed);
    }
  }
  EXPECT_GT(removed, 1000);
  EXPECT_GT(stayed, 1000);
}

TEST(GpuDetectByStrain, CutsUniformStretchFalselyAndRigidMotionNever) {
  const cutproof::Setup setup = setup_of(fixtures::block(8, 4, 4, 0.01), Criterion::strain);
  State state = cooked(setup);
  for (Vec3& x : state.x) x = {1.19 * x.x + 3, x.y, x.z};
  EXPECT_TRUE(detected(setup, state).removed.empty());
  for (Vec3& x : state.x) x = {1.25 * x.x, x.y, x.z};
  EXPECT_EQ(detected(setup, state).removed.size(), state.x.size());
  cutproof::Setup strict = setup;
  strict.detect.strain = 1 + 1e-5;
  state = cooked(setup);
  for (Vec3& x : state.x) x = {-x.y, x.x, x.z};
  EXPECT_TRUE(detected(strict, state).removed.empty());
}

// ---- All together

TEST(GpuDetect, JudgesEachBodyOfALoadByItsOwnCriterionUnderAnySchedule) {
  std::vector<cutproof::Setup> setups;
  std::vector<State> states;
  for (const Criterion criterion :
       {Criterion::geometric, Criterion::distance, Criterion::none, Criterion::strain, Criterion::geometric,
        Criterion::distance, Criterion::distance, Criterion::distance}) {
    cutproof::Setup setup = setup_of(fixtures::block(5, 4, 3, 1.0), criterion);
    if (setups.size() >= 6) setup.detect.remove = setups.size() == 6 ? RemovedEnds::one : RemovedEnds::nearer;
    const BladePose pose = {{3, 2, 0}, {0, 1, 0}, {0, 0, 1}};
    sweep(setup, pose, pose, 10, 10, setups.empty() ? 0 : 2.5);
    State state = cooked(setup);
    for (Vec3& x : state.x) x.x *= setups.size() == 3 ? 1.3 : setups.size() >= 5 ? 1.6 : 1.0;
    setups.push_back(setup);
    states.push_back(state);
  }
  for (int seed = 0; seed < 12; ++seed) {
    HostLauncher launcher(HostLauncher::Simulated{.schedule = seed % 2 ? random_walk(static_cast<uint64_t>(seed))
                                                                       : pct(static_cast<uint64_t>(seed), 3, 10000)});
    Counters counters{};
    const std::vector<State> actual = detected(setups, states, launcher, &counters);
    std::size_t removed = 0;
    for (std::size_t b = 0; b < setups.size(); ++b) {
      const State exact = expected(setups[b], states[b]);
      EXPECT_EQ(actual[b].removed, exact.removed) << "body " << b << ", seed " << seed;
      EXPECT_EQ(actual[b].alive, exact.alive) << "body " << b << ", seed " << seed;
      removed += exact.removed.size();
    }
    EXPECT_EQ(counters.removed, static_cast<int>(removed));
    EXPECT_GT(removed, 100u);
  }
}

}  // namespace
}  // namespace cutproof::gpu::detect_kernel_test
