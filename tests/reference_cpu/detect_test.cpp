// Stage detect: what each criterion removes, against brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "model/at.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference::detect_test {
namespace {

Setup setup_of(Body body) {
  cutproof::Setup setup;
  setup.body = std::move(body);
  setup.step.substeps = 1;
  setup.substep_length = {0.01};
  return setup;
}

State cooked(const Setup& setup) { return fixtures::cook(setup.body, {}, setup.expand, setup.merge, 1); }

void sweep(Setup& setup, BladePose from, BladePose to, double length, double depth, double thickness) {
  setup.detect.criterion = Criterion::geometric;
  setup.has_blade = true;
  setup.blade = {length, depth, thickness, 0};
  setup.blade_moves = {{from, to, true, 0}};
}

TEST(DetectByDistance, RemovesBothEndsOfAnEdgeThatIsTooLongAndNothingElse) {
  const cutproof::Setup setup = setup_of(fixtures::block(6, 1, 1, 1.0));
  State state = cooked(setup);
  for (std::size_t i = 3; i < 6; ++i) state.x[i].x += 0.500001;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{2, 3}));
  EXPECT_EQ(state.alive, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1}));
}

TEST(DetectByDistance, KeepsAnEdgeOfExactlyTheLimit) {
  const cutproof::Setup setup = setup_of(fixtures::block(2, 1, 1, 1.0));
  State state = cooked(setup);
  state.x[1].x += 0.5;
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
}

TEST(DetectByDistance, IgnoresDeadNeighbours) {
  const cutproof::Setup setup = setup_of(fixtures::block(3, 1, 1, 1.0));
  State state = cooked(setup);
  state.alive[1] = 0;
  state.x[1].y += 10;
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
}

// --- One end of each edge ---

cutproof::Setup one_end(Body body) {
  cutproof::Setup setup = setup_of(std::move(body));
  setup.detect.remove = RemovedEnds::one;
  return setup;
}

TEST(DetectOneEnd, TakesTheLowerOfTwoThatAreAlike) {
  const cutproof::Setup setup = one_end(fixtures::block(6, 1, 1, 1.0));
  State state = cooked(setup);
  for (std::size_t i = 3; i < 6; ++i) state.x[i].x += 0.500001;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{2}));
}

TEST(DetectOneEnd, TakesTheOneWithMoreOpenEdges) {
  // 3 × 3: the middle, 4, is pulled out, so it has four edges that are too long and each neighbour one.
  const cutproof::Setup setup = one_end(fixtures::block(3, 3, 1, 1.0));
  State state = cooked(setup);
  state.x[4].z += 5;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{4}));
  // With only one of them alive both have one, and the lower goes.
  state = cooked(setup);
  state.x[4].z += 5;
  for (const std::size_t i : {1u, 5u, 7u}) state.alive[i] = 0;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{3}));
}

// The blade's plane is x = 2.5 (its edge along y, its back along z, so its normal along x), between the second and the
// third column, which are too far from each other.
TEST(DetectOneEnd, TakesTheEndOnTheNegativeSideOfABladeThatIsLowered) {
  cutproof::Setup setup = one_end(fixtures::block(5, 3, 3, 1.0));  // columns at x = 1 … 5
  const auto at_blade = [&](bool turned) {
    const BladePose pose = {{2.5, 2, 2}, {0, turned ? -1.0 : 1.0, 0}, {0, 0, 1}};
    setup.has_blade = true;
    setup.blade = {0.1, 0.1, 0, 0};  // the plane counts, however small the plate
    setup.blade_moves = {{pose, pose, true, 0}};
  };
  const auto columns_of = [&](const State& state) {
    std::vector<double> columns;
    for (const int32_t i : state.removed) columns.push_back(setup.body.rest_position(i).x);
    return columns;
  };
  State pulled = cooked(setup);
  for (Vec3& x : pulled.x) x.x += x.x > 2.5 ? 0.4 : -0.4;
  at_blade(false);
  State state = pulled;
  detect(setup, state);
  EXPECT_EQ(columns_of(state), std::vector<double>(9, 2.0));
  at_blade(true);
  state = pulled;
  detect(setup, state);
  EXPECT_EQ(columns_of(state), std::vector<double>(9, 3.0));
  // While it is up it takes no side: the lower of two that are alike.
  setup.blade_moves[0].down = false;
  state = pulled;
  detect(setup, state);
  EXPECT_EQ(columns_of(state), std::vector<double>(9, 2.0));
}

TEST(DetectOneEnd, AsksTheBladeWhereItStoodLastWhileItWasLowered) {
  cutproof::Setup setup = one_end(fixtures::block(2, 1, 1, 1.0));
  setup.step.substeps = 3;
  setup.has_blade = true;
  setup.blade = {1, 1, 0, 0};
  const BladePose here = {{1.5, 1, 1}, {0, -1, 0}, {0, 0, 1}};  // its negative side is that of particle 1
  BladePose away = here;
  away.edge.x = -10;
  setup.blade_moves = {{away, here, true, 0}, {here, here, false, 0}, {away, away, false, 0}};
  State state = cooked(setup);
  state.x[1].x += 1;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{1}));
  // Lowered once more elsewhere, it is not between them any more.
  setup.blade_moves[2].down = true;
  state = cooked(setup);
  state.x[1].x += 1;
  detect(setup, state);
  EXPECT_EQ(state.removed, (std::vector<int32_t>{0}));
}

// Two halves of a row, of one cluster each, in one piece: the clusters carry their particles where they are. The blade
// stands between them nearer to one, and takes that one by `nearer`, but the negative one, 3, where they are as near as
// to h/8.
TEST(DetectNearerEnd, TakesTheEndThatItsClustersCarryNearerToTheBlade) {
  cutproof::Setup setup = one_end(fixtures::block(6, 1, 1, 1.0));  // at x = 1 … 6
  setup.detect.remove = RemovedEnds::nearer;
  State state = cooked(setup);
  state.clusters = {};
  for (int32_t c = 0; c < 2; ++c) {
    state.clusters.number.push_back(c);
    state.clusters.offsets.push_back(3 * (c + 1));
    for (int32_t i = 0; i < 3; ++i) state.clusters.members.push_back(3 * c + i);
    state.clusters.rotation.push_back(Mat3{});
  }
  state.clusters.mass.resize(2);
  state.clusters.rest_center.resize(2);
  update_rest_frames(setup.body, state.clusters);
  for (std::size_t i = 3; i < 6; ++i) state.x[i].x += 1;  // 2 at 3, 3 at 5
  // What a contact does to the ends themselves is not asked.
  state.x[2].x -= 0.3;
  state.x[1].x += 0.3;
  setup.has_blade = true;
  setup.blade = {1, 1, 0, 0};
  for (const bool turned : {false, true}) {  // which end is the negative one
    for (const double from_middle : {-0.5, -0.07, -0.06, 0.0, 0.06, 0.07, 0.5}) {
      const BladePose pose = {{4 + from_middle, 1, 1}, {0, turned ? -1.0 : 1.0, 0}, {0, 0, 1}};
      setup.blade_moves = {{pose, pose, true, 0}};
      const int32_t negative = turned ? 3 : 2, nearer = from_middle < 0 ? 2 : 3;
      State cut = state;
      detect(setup, cut);
      const int32_t expected = 2 * std::abs(from_middle) > kNearerBy ? nearer : negative;
      EXPECT_EQ(cut.removed, std::vector<int32_t>{expected}) << from_middle << (turned ? " turned" : "");
    }
  }
  // Beside both ends it has no say.
  const BladePose beside = {{9, 1, 1}, {0, 1, 0}, {0, 0, 1}};
  setup.blade_moves = {{beside, beside, true, 0}};
  State cut = state;
  detect(setup, cut);
  EXPECT_EQ(cut.removed, std::vector<int32_t>{2});
}

// On random bodies: no edge that is too long keeps both ends, who goes had such an edge, and no more go than with both.
TEST(DetectOneEnd, LeavesNoOpenEdgeAndTakesNobodyWithoutOne) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  std::size_t one = 0, both = 0;
  for (int trial = 0; trial < 40; ++trial) {
    cutproof::Setup setup = one_end(fixtures::block(6, 5, 4, 1.0));
    const BladePose pose = {{3.5, 2, 2}, {0, 1, 0}, {0, 0, 1}};
    setup.has_blade = true;
    setup.blade = {1, 1, 0, 0};
    setup.blade_moves = {{pose, pose, trial % 2 == 0, 0}};
    setup.detect.remove = trial % 4 < 2 ? RemovedEnds::one : RemovedEnds::nearer;
    State before = cooked(setup);
    for (Vec3& x : before.x) x += 0.2 * Vec3{normal(random), normal(random), normal(random)};
    State after = before;
    detect(setup, after);
    setup.detect.remove = RemovedEnds::both;
    State all = before;
    detect(setup, all);
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      EXPECT_LE(all.alive[at(i)], after.alive[at(i)]) << "who goes has an edge that is too long";
      for (const int32_t j : setup.body.neighbours(i)) {
        EXPECT_FALSE(after.alive[at(i)] && after.alive[at(j)] && norm(before.x[at(i)] - before.x[at(j)]) > 1.5);
      }
    }
    one += after.removed.size();
    both += all.removed.size();
  }
  EXPECT_GT(one, 100u);
  EXPECT_LT(one, 0.7 * static_cast<double>(both));
}

TEST(DetectByDistance, NeverCutsUniformStretchBelowTheLimit) {
  const cutproof::Setup setup = setup_of(fixtures::block(8, 4, 4, 0.01));
  State state = cooked(setup);
  for (Vec3& x : state.x) x = {1.49 * x.x, 0.8 * x.y, 0.8 * x.z};
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
}

TEST(DetectByStrain, CutsUniformStretchFalsely) {
  cutproof::Setup setup = setup_of(fixtures::block(8, 4, 4, 0.01));
  setup.detect.criterion = Criterion::strain;
  State state = cooked(setup);
  for (Vec3& x : state.x) x = {1.19 * x.x, x.y, x.z};
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
  for (Vec3& x : state.x) x.x *= 1.25 / 1.19;
  detect(setup, state);
  EXPECT_EQ(state.removed.size(), state.x.size()) << "every cluster is stretched by 1.25";
}

TEST(DetectByStrain, IsNotMisledByFlatClusters) {
  cutproof::Setup setup = setup_of(fixtures::block(5, 5, 1, 0.01));
  setup.detect.criterion = Criterion::strain;
  State state = cooked(setup);
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
}

// Brute force: the blade at many positions and turns along the way, its rectangle sampled through the closest point.
double sampled_distance(const Blade& blade, const BladePose& from, const BladePose& to, Vec3 x, int samples) {
  double best = 1e300;
  for (int k = 0; k <= samples; ++k) {
    const double t = static_cast<double>(k) / samples;
    const Vec3 edge = from.edge + t * (to.edge - from.edge);
    // Only turns about `back` occur below.
    const Vec3 normal = cross(from.along, from.back);
    const double angle = t * std::atan2(dot(to.along, normal), dot(to.along, from.along));
    const Vec3 along = std::cos(angle) * from.along + std::sin(angle) * normal;
    const double u = std::clamp(dot(x - edge, along), -blade.length / 2, blade.length / 2);
    const double w = std::clamp(dot(x - edge, from.back), 0.0, blade.depth);
    best = std::min(best, norm(x - edge - u * along - w * from.back));
  }
  return best;
}

TEST(DetectGeometric, RemovesWhatIsWithinReachOfTheSweptMidSurface) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  int removed = 0, kept = 0;
  for (int trial = 0; trial < 120; ++trial) {
    cutproof::Setup setup = setup_of(fixtures::block(7, 7, 7, 1.0));
    const double a = 6 * unit(random), b = trial % 2 == 0 ? a + 0.6 * unit(random) : a;
    BladePose from{
        {1 + 7 * unit(random), 1 + 7 * unit(random), 1 + 7 * unit(random)}, {std::cos(a), std::sin(a), 0}, {0, 0, 1}};
    BladePose to = from;
    to.along = {std::cos(b), std::sin(b), 0};
    to.edge += Vec3{4 * unit(random) - 2, 4 * unit(random) - 2, 4 * unit(random) - 2};
    if (trial % 7 == 0) to.edge = from.edge;
    const double thickness = 2 * unit(random);
    // A turn moves the ends of a long edge most.
    sweep(setup, from, to, 1 + (b == a ? 3 : 9) * unit(random), 1 + 3 * unit(random), thickness);
    State state = cooked(setup);
    detect(setup, state);
    const double reach = std::max(thickness, 1.0) / 2;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      // The sampled way is off by at most half its step. What is within reach always goes; where the blade turns, so
      // may what is farther by twice the slack of the sweep's pieces, 0.05 h: once for the slack itself, once for how
      // far a piece is from the true sweep.
      const double band = 0.002, slack = b == a ? 0 : 2 * 0.05;
      // Between two of 40 places the plate moves by less than 0.2 h: they decide what is not near the reach.
      const double about = sampled_distance(setup.blade, from, to, state.x[i], 40);
      const bool is_near = about >= reach - band && about <= reach + band + slack + 0.2;
      const double distance = is_near ? sampled_distance(setup.blade, from, to, state.x[i], 4000) : about;
      if (distance >= reach - band && distance <= reach + band + slack) continue;
      EXPECT_EQ(state.alive[i] == 0, distance < reach) << "trial " << trial << ", particle " << i << ", " << distance;
      ++(state.alive[i] ? kept : removed);
    }
  }
  EXPECT_GT(removed, 500);
  EXPECT_GT(kept, 500);
}

TEST(DetectGeometric, TakesBothLayersWhenTheBladeIsHalfwayBetweenThem) {
  cutproof::Setup setup =
      setup_of(fixtures::block(4, 4, 4, 0.1));  // 0.1 is not a binary fraction: the tie is a rounded one
  const BladePose pose = {{0.25, 0.25, 0}, {1, 0, 0}, {0, 0, 1}};
  sweep(setup, pose, pose, 2, 2, 0);
  State state = cooked(setup);
  detect(setup, state);
  EXPECT_EQ(state.removed.size(), 32u) << "the layers at y = 0.2 and 0.3";
}

TEST(DetectGeometric, AThinBladeOfAnyPlaneSeparatesWhateverEdgeItCrosses) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    cutproof::Setup setup = setup_of(fixtures::block(6, 6, 6, 1.0));
    const Vec3 n = normalized({normal(random), normal(random), normal(random)});
    const Vec3 along = normalized(cross(n, std::abs(n.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const Vec3 back = cross(n, along);
    const Vec3 middle = {3.5 + normal(random), 3.5 + normal(random), 3.5 + normal(random)};
    const BladePose pose = {middle - 20 * back, along, back};
    sweep(setup, pose, pose, 40, 40, 0.0);
    State state = cooked(setup);
    detect(setup, state);
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      for (const int direction : {0, 2, 4}) {
        const int32_t j = setup.body.neighbour(i, direction);
        if (j < 0) continue;
        const auto p = static_cast<std::size_t>(i), q = static_cast<std::size_t>(j);
        const double a = dot(state.x[p] - middle, n), b = dot(state.x[q] - middle, n);
        if (a * b >= 0) continue;
        EXPECT_FALSE(state.alive[p] && state.alive[q]) << "edge " << i << "-" << j << " is crossed";
      }
    }
  }
}

TEST(DetectGeometric, DoesNothingWhileTheBladeIsUp) {
  cutproof::Setup setup = setup_of(fixtures::block(4, 4, 4, 1.0));
  const BladePose pose = {{2, 2, 0}, {1, 0, 0}, {0, 0, 1}};
  sweep(setup, pose, pose, 10, 10, 1);
  setup.blade_moves[0].down = false;
  State state = cooked(setup);
  detect(setup, state);
  EXPECT_TRUE(state.removed.empty());
}

}  // namespace
}  // namespace cutproof::reference::detect_test
