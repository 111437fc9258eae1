// Each oracle of one stage: a right pair of states is accepted, an answer broken by hand is rejected with the right
// witness.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "oracles/oracles.h"
#include "tests/oracles/corruptions.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles {
namespace {

using namespace cutproof::testing;
using Numbers = std::vector<int32_t>;

void expect_holds(const Verdict& verdict) {
  EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  EXPECT_EQ(verdict.witness, Witness{});
  EXPECT_LE(verdict.measured, verdict.bound);
  EXPECT_FALSE(verdict.unit.empty());
  EXPECT_FALSE(verdict.bound_source.empty());
}

void expect_rejected(const Verdict& verdict, const Numbers& clusters, const Numbers& particles) {
  EXPECT_FALSE(verdict.holds) << verdict.property;
  EXPECT_GT(verdict.measured, verdict.bound);
  EXPECT_EQ(verdict.witness.clusters, clusters) << verdict.witness.text;
  EXPECT_EQ(verdict.witness.particles, particles) << verdict.witness.text;
  EXPECT_FALSE(verdict.witness.text.empty());
}

// A state before and after a stage.
struct Pair {
  Setup setup;
  State before, after;
};

Pair pair_of(Body body, const Lists& before, const Lists& after) {
  Pair pair;
  pair.setup = setup_of(std::move(body));
  pair.before = state_of(pair.setup.body, before);
  pair.after = state_of(pair.setup.body, after);
  return pair;
}

void set_clusters(const Setup& setup, State& state, const Lists& lists, const Numbers& numbers) {
  state.clusters = clusters_of(setup.body, lists);
  state.clusters.number = numbers;
}

Mat3 turn_about_z(double angle) {
  return {{std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1}};
}

// --- Detection -------------------------------------------------------------------------------------------------------

// A row of four with h = 1 and epsilon = 1.5 whose last particle is pulled away: 0 1 2 → 3.
Pair pulled(double distance) {
  Pair pair = pair_of(block_body(4, 1, 1), {{0, 1, 2, 3}}, {{0, 1, 2, 3}});
  pair.setup.detect.without_blade = true;
  pair.before.x[3].x = pair.before.x[2].x + distance;
  pair.after.x = pair.before.x;
  return pair;
}

TEST(Detection, AcceptsBothEndsOfALongEdgeAndNothingElse) {
  Pair pair = pulled(1.6);
  remove_particles(pair.after, {2, 3});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  EXPECT_EQ(detection(pair.setup, pair.before, pair.after).checked, 4);
}

TEST(Detection, RejectsAnEdgeOfWhichOneEndWasForgotten) {
  Pair pair = pulled(1.6);
  remove_particles(pair.after, {3});
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
}

TEST(Detection, RejectsRemovalOfWhatIsNotStretched) {
  Pair pair = pulled(1.4);
  remove_particles(pair.after, {1});
  const Verdict verdict = detection(pair.setup, pair.before, pair.after);
  EXPECT_FALSE(verdict.holds);
  ASSERT_FALSE(verdict.witness.particles.empty());
  EXPECT_EQ(verdict.witness.particles[0], 1);
}

TEST(Detection, CallsEitherOnlyWhatRoundingCanTip) {
  for (const bool removes : {false, true}) {
    // Within a few ulp of εh both answers are right.
    Pair tie = pulled(1.5);
    if (removes) remove_particles(tie.after, {2, 3});
    expect_holds(detection(tie.setup, tie.before, tie.after));
    // 1e-14 away only one is.
    Pair over = pulled(1.5 * (1 + 1e-14)), under = pulled(1.5 * (1 - 1e-14));
    if (removes) {
      remove_particles(over.after, {2, 3});
      remove_particles(under.after, {2, 3});
    }
    EXPECT_EQ(detection(over.setup, over.before, over.after).holds, removes);
    EXPECT_EQ(detection(under.setup, under.before, under.after).holds, !removes);
  }
}

TEST(Detection, RejectsDistancesToNeighboursThatWereDeadBefore) {
  Pair pair = pulled(5);
  pair.before.alive[3] = 0;
  pair.after.alive[3] = 0;
  expect_holds(detection(pair.setup, pair.before, pair.after));
  remove_particles(pair.after, {2});
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 1});
}

TEST(Detection, RejectsAListThatIsNotWhatDied) {
  Pair pair = pulled(1.6);
  remove_particles(pair.after, {2, 3});
  pair.after.removed = {2};
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {3});
  pair.after.removed = {1, 2, 3};
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {1});
}

TEST(Detection, RejectsTheDeadComingBack) {
  Pair pair = pulled(1);
  pair.before.alive[1] = 0;
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {1});
}

TEST(Detection, RejectsRemovalWhereNothingIsEverRemoved) {
  for (const bool without_blade : {false, true}) {
    Pair pair = pulled(2);
    if (without_blade) {
      pair.setup.detect.criterion = Criterion::none;
    } else {
      pair.setup.detect.without_blade = false;
    }
    expect_holds(detection(pair.setup, pair.before, pair.after));
    remove_particles(pair.after, {2, 3});
    expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
  }
}

TEST(Detection, OfStrainChecksTheListOnly) {
  Pair pair = pulled(1);
  pair.setup.detect.criterion = Criterion::strain;
  remove_particles(pair.after, {0});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair.after.removed = {};
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {0});
}

// A 5 × 1 × 5 sheet in the plane y = 1, x and z from 1 to 5, and a blade that comes down at x = `place`, its edge
// along y, from z = 10 to z = 3.
Pair struck(double place, double thickness) {
  Pair pair = pair_of(block_body(5, 1, 5), {range(0, 25)}, {range(0, 25)});
  pair.setup.detect.criterion = Criterion::geometric;
  pair.setup.has_blade = true;
  pair.setup.blade = {4, 6, thickness, 0};
  for (int s = 0; s < 4; ++s) {
    const auto pose = [&](double t) { return BladePose{{place, 1, 10 - 7 * t}, {0, 1, 0}, {0, 0, 1}}; };
    pair.setup.blade_moves.push_back({pose(s / 4.0), pose((s + 1) / 4.0), true, 0});
  }
  return pair;
}

TEST(Detection, OfAGeometricCutTakesWhatLiesWithinHalfASpacingOfTheSweep) {
  Pair pair = struck(3.2, 0.1);
  // x = 3 (third column), z >= 3 - 0.5: rows z = 3, 4, 5 with k = 2, 3, 4.
  remove_particles(pair.after, {12, 17, 22});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  State forgot = pair.before;
  remove_particles(forgot, {17, 22});
  EXPECT_EQ(detection(pair.setup, pair.before, forgot).witness.particles.at(0), 12);
  State more = pair.before;
  remove_particles(more, {7, 12, 17, 22});
  EXPECT_EQ(detection(pair.setup, pair.before, more).witness.particles.at(0), 7);
}

TEST(Detection, OfAGeometricCutTakesBothLayersOfATie) {
  Pair pair = struck(3.5, 0.1);
  remove_particles(pair.after, {12, 13, 17, 18, 22, 23});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  State none = pair.before;
  EXPECT_FALSE(detection(pair.setup, pair.before, none).holds);
}

TEST(Detection, OfAThickBladeTakesItsThickness) {
  Pair pair = struck(3, 2.2);
  remove_particles(pair.after, {6, 7, 8, 11, 12, 13, 16, 17, 18, 21, 22, 23});
  // z >= 3 - 1.1: the middle column from z = 2 on; its neighbours there are sqrt(2) away.
  pair.after.alive[6] = pair.after.alive[8] = 1;
  std::erase_if(pair.after.removed, [](int32_t i) { return i == 6 || i == 8; });
  expect_holds(detection(pair.setup, pair.before, pair.after));
}

TEST(Detection, OfAGeometricCutReachesFartherWhereTissueIsStretched) {
  Pair pair = struck(3.5, 0.1);
  // The edge from 3 to 4 along x is stretched to 2.2; the blade passes 1.1 from both ends.
  for (std::size_t i = 0; i < 25; ++i) {
    if (i % 5 >= 3) pair.before.x[i].x += 1.2;
  }
  for (auto& move : pair.setup.blade_moves) move.from.edge.x = move.to.edge.x = 4.1;
  pair.after.x = pair.before.x;
  remove_particles(pair.after, {12, 13, 17, 18, 22, 23});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  EXPECT_FALSE(detection(pair.setup, pair.before, pair.before).holds);
}

TEST(Detection, OfAGeometricCutIgnoresABladeThatIsUp) {
  Pair pair = struck(3.2, 0.1);
  for (auto& move : pair.setup.blade_moves) move.down = false;
  expect_holds(detection(pair.setup, pair.before, pair.after));
}

// Particles far from each other (so that d_i = 0), anywhere; whoever brute force leaves in doubt is dead from the
// start.
TEST(Detection, OfAGeometricCutAgreesWithBruteForceForAnyMove) {
  constexpr uint64_t kSeed = 11;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto direction = [&] {
    for (;;) {
      const Vec3 v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      if (norm(v) > 0.1 && norm(v) < 1) return normalized(v);
    }
  };
  std::vector<Node> nodes;
  for (int32_t i = 0; i < 400; ++i) nodes.push_back({2 * (i % 20), 2 * (i / 20), 0});
  int64_t hits = 0, misses = 0;
  for (int round = 0; round < 60; ++round) {
    Pair pair = pair_of(body_of(nodes), {range(0, 400)}, {range(0, 400)});
    pair.setup.step.substeps = 1;
    pair.setup.detect.criterion = Criterion::geometric;
    pair.setup.has_blade = true;
    pair.setup.blade = {uniform(0.5, 3), uniform(0.5, 3), uniform(0, 2), 0};
    BladeMove move;
    move.down = true;
    move.from.along = direction();
    move.from.back = normalized(cross(move.from.along, direction()));
    move.to = move.from;
    move.to.edge = uniform(0, 2) * direction();
    if (round % 3 == 1) move.to.edge = uniform(-2, 2) * move.from.along + uniform(-1, 1) * move.from.back;  // coplanar
    if (round % 12 == 3) move.to.edge = {};                                                                 // at rest
    const bool turns = round % 2 == 1;
    const Vec3 axis = direction();
    const double angle = turns ? uniform(0.05, 0.6) : 0;
    const auto rotated = [&](Vec3 v, double t) {
      return std::cos(t * angle) * v + std::sin(t * angle) * cross(axis, v) +
             (1 - std::cos(t * angle)) * dot(axis, v) * axis;
    };
    if (turns) {
      move.to.along = rotated(move.from.along, 1);
      move.to.back = rotated(move.from.back, 1);
    }
    pair.setup.blade_moves = {move};

    const double reach = std::max(pair.setup.blade.thickness, 1.0) / 2;
    Numbers removed;
    for (int32_t i = 0; i < 400; ++i) {
      const auto p = static_cast<std::size_t>(i);
      const Vec3 x = {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)};
      pair.before.x[p] = x;
      constexpr int kSteps = 1000;
      double least = std::numeric_limits<double>::infinity();
      for (int k = 0; k <= kSteps; ++k) {
        const double t = static_cast<double>(k) / kSteps;
        const Vec3 d = x - t * move.to.edge;
        const Vec3 along = rotated(move.from.along, t), back = rotated(move.from.back, t);
        const double u = std::clamp(dot(d, along), -pair.setup.blade.length / 2, pair.setup.blade.length / 2);
        const double w = std::clamp(dot(d, back), 0.0, pair.setup.blade.depth);
        least = std::min(least, norm(d - u * along - w * back));
      }
      const double doubt = (norm(move.to.edge) + 3.4 * angle) / kSteps;  // to the nearest sample
      if (least <= reach - 2e-9) {
        removed.push_back(i);
        ++hits;
      } else if (least - doubt > reach + (turns ? 0.1 : 0) + 2e-9) {
        ++misses;
      } else {
        pair.before.alive[p] = 0;
      }
    }
    pair.after.x = pair.before.x;
    pair.after.alive = pair.before.alive;
    remove_particles(pair.after, removed);
    const Verdict verdict = detection(pair.setup, pair.before, pair.after);
    EXPECT_TRUE(verdict.holds) << "round " << round << ": " << verdict.witness.text;
    // And the oracle is not simply content: whichever answer is turned round is noticed.
    const std::size_t odd = random() % 400;
    if (pair.before.alive[odd] == 0) continue;
    pair.after.alive[odd] ^= 1;
    pair.after.removed.clear();
    for (int32_t i = 0; i < 400; ++i) {
      const auto p = static_cast<std::size_t>(i);
      if (pair.before.alive[p] != 0 && pair.after.alive[p] == 0) pair.after.removed.push_back(i);
    }
    EXPECT_FALSE(detection(pair.setup, pair.before, pair.after).holds) << "round " << round;
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(misses, 1000);
}

TEST(Detection, AcceptsABodyOfNoneAndOfOneParticle) {
  Pair none = pair_of(body_of({}), {}, {});
  none.setup.detect.without_blade = true;
  expect_holds(detection(none.setup, none.before, none.after));
  EXPECT_EQ(detection(none.setup, none.before, none.after).checked, 0);
  Pair one = pair_of(block_body(1, 1, 1), {{0}}, {{0}});
  one.setup.detect.without_blade = true;
  expect_holds(detection(one.setup, one.before, one.after));
  remove_particles(one.after, {0});
  expect_rejected(detection(one.setup, one.before, one.after), {}, {0});
}

// --- Split -----------------------------------------------------------------------------------------------------------

// A row of nine, cut at 4. Cluster 0 lies left of the cut, 2 across it, 5 right of it and across it, 6 right.
Pair cut_row() {
  Pair pair = pair_of(block_body(9, 1, 1), {}, {});
  set_clusters(pair.setup, pair.before, {{0, 1, 2}, {1, 2, 3, 4, 5}, {3, 4, 5, 6, 7}, {7, 8}}, {0, 2, 5, 6});
  for (std::size_t c = 0; c < 4; ++c) pair.before.clusters.rotation[c] = turn_about_z(static_cast<double>(c));
  remove_particles(pair.before, {4});
  pair.after = pair.before;
  // 2 keeps {1, 2, 3}, 5 keeps {3}; {5} of 2 becomes 7, {5, 6, 7} of 5 becomes 8.
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  const std::array<int, 6> parent = {0, 1, 2, 3, 1, 2};
  for (std::size_t c = 0; c < 6; ++c) pair.after.clusters.rotation[c] = turn_about_z(parent[c]);
  return pair;
}

TEST(SplitExactness, AcceptsComponentsNumberedByClusterAndSmallestParticle) {
  const Pair pair = cut_row();
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 4);
}

TEST(SplitExactness, RejectsAComponentThatWasGluedToAnother) {
  Pair pair = cut_row();
  const auto rotations = pair.after.clusters.rotation;
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3, 5}, {3}, {7, 8}, {5, 6, 7}}, {0, 2, 5, 6, 8});
  pair.after.clusters.rotation.assign(rotations.begin(), rotations.begin() + 5);
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  expect_rejected(verdict, {2}, {1, 5});
  EXPECT_EQ(verdict.measured, 3);  // 7 is missing too, and 8 has not its parent's rotation
}

TEST(SplitExactness, RejectsAComponentThatWasTornApart) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  const auto parent = cut_row().after.clusters.rotation;
  pair.after.clusters.rotation = parent;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {2}, {3, 1});
}

TEST(SplitExactness, RejectsATailThatWasLost) {
  Pair pair = cut_row();
  const auto rotations = pair.after.clusters.rotation;
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}}, {0, 2, 5, 6, 7});
  pair.after.clusters.rotation.assign(rotations.begin(), rotations.begin() + 5);
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {8}, {5});
}

TEST(SplitExactness, RejectsNumbersInAnotherOrder) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5, 6, 7}, {5}}, {0, 2, 5, 6, 7, 8});
  const auto& turned = cut_row().after.clusters.rotation;
  pair.after.clusters.rotation = {turned[0], turned[1], turned[2], turned[3], turned[5], turned[4]};
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, Numbers({7}));
}

TEST(SplitExactness, RejectsTheNumberGoingToTheOtherComponent) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {5}, {3}, {7, 8}, {1, 2, 3}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  pair.after.clusters.rotation = cut_row().after.clusters.rotation;
  EXPECT_EQ(split_exactness(pair.setup, pair.before, pair.after).witness.clusters, Numbers({2}));
}

TEST(SplitExactness, RejectsTouchingAClusterThatLostNothing) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  pair.after.clusters.rotation = cut_row().after.clusters.rotation;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {0}, {2, 0});
  pair = cut_row();
  pair.after.clusters.rotation[3] = Mat3{};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {6}, {});
}

TEST(SplitExactness, RejectsANewClusterWithoutItsParentsRotation) {
  Pair pair = cut_row();
  pair.after.clusters.rotation[5] = Mat3{};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {8}, {});
}

TEST(SplitExactness, RejectsADeadParticleKept) {
  Pair pair = cut_row();
  pair.after = pair.before;
  const Verdict verdict = split_exactness(pair.setup, pair.before, pair.after);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, Numbers({2}));
}

TEST(SplitExactness, RejectsAClusterFromNowhere) {
  Pair pair = cut_row();
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}, {8}}, {0, 2, 5, 6, 7, 8, 9});
  auto rotations = cut_row().after.clusters.rotation;
  rotations.emplace_back();
  pair.after.clusters.rotation = rotations;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {9}, {8});
}

TEST(SplitExactness, TakesComponentsWithinTheClusterNotWithinTheTissue) {
  // 6 7 8
  // 3 4 5
  // 0 1 2   4 is removed from {3, 4, 5}: 3 and 5 are connected around it, but not within the cluster.
  Pair pair = pair_of(block_body(3, 3, 1), {{3, 4, 5}, range(0, 9)}, {});
  remove_particles(pair.before, {4});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{3}, {0, 1, 2, 3, 5, 6, 7, 8}, {5}}, {0, 1, 2});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  set_clusters(pair.setup, pair.after, {{3, 5}, {0, 1, 2, 3, 5, 6, 7, 8}}, {0, 1});
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {0}, {3, 5});
}

TEST(SplitExactness, AcceptsAClusterThatVanished) {
  Pair pair = pair_of(block_body(4, 1, 1), {{0}, {0, 1, 2, 3}}, {});
  remove_particles(pair.before, {0});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{1, 2, 3}}, {1});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
}

TEST(SplitExactness, AcceptsNothingRemovedAndABodyCutAwayEntirely) {
  Pair pair = pair_of(block_body(4, 1, 1), {{0, 1}, {1, 2, 3}}, {{0, 1}, {1, 2, 3}});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  remove_particles(pair.before, {0, 1, 2, 3});
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {}, {});
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
  const Pair none = pair_of(body_of({}), {}, {});
  expect_holds(split_exactness(none.setup, none.before, none.after));
  EXPECT_EQ(split_exactness(none.setup, none.before, none.after).checked, 0);
}

// A row of six cut at 2: {0, 1} is debris if fewer than three particles are, {3, 4, 5} is not.
Pair debris_row() {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2, 3}, {3, 4, 5}}, {});
  pair.setup.split.debris = 3;
  remove_particles(pair.before, {2});
  pair.after = pair.before;
  pair.after.alive[0] = pair.after.alive[1] = 0;
  pair.after.debris = {0, 1};
  set_clusters(pair.setup, pair.after, {{3}, {3, 4, 5}}, {0, 1});
  return pair;
}

TEST(SplitExactness, AcceptsDebrisBelowTheLimitOnly) {
  const Pair pair = debris_row();
  expect_holds(split_exactness(pair.setup, pair.before, pair.after));
}

TEST(SplitExactness, RejectsDebrisThatWasKept) {
  Pair pair = debris_row();
  pair.after = pair.before;
  set_clusters(pair.setup, pair.after, {{0, 1}, {3, 4, 5}, {3}}, {0, 1, 2});
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {0});
}

TEST(SplitExactness, RejectsDebrisThatIsLargeEnough) {
  Pair pair = debris_row();
  pair.setup.split.debris = 2;
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {0});
}

TEST(SplitExactness, RejectsDebrisThatIsNotListed) {
  Pair pair = debris_row();
  pair.after.debris = {0};
  expect_rejected(split_exactness(pair.setup, pair.before, pair.after), {}, {1});
}

// --- Merge -----------------------------------------------------------------------------------------------------------

// Merging on a row of n particles.
struct Merge {
  Merge(int32_t n, const Lists& before, int32_t tau, int32_t cap) : pair(pair_of(block_body(n, 1, 1), before, before)) {
    pair.before.tau = pair.after.tau = tau;
    pair.before.cap = pair.after.cap = cap;
    for (std::size_t c = 0; c < before.size(); ++c) {
      pair.before.clusters.rotation[c] = turn_about_z(static_cast<double>(c));
    }
  }
  // Every cluster has the rotation of the one whose number it keeps.
  Verdict judge(const Lists& after, const Numbers& numbers) {
    set_clusters(pair.setup, pair.after, after, numbers);
    for (std::size_t c = 0; c < numbers.size(); ++c) pair.after.clusters.rotation[c] = turn_about_z(numbers[c]);
    return merge_legality(pair.setup, pair.before, pair.after);
  }
  Pair pair;
};

TEST(MergeLegality, AcceptsNothingMergedAndSmallClustersMerged) {
  Merge merge(8, {{0, 1, 2}, {2, 3}, {4}, {4, 5, 6, 7}}, 3, 6);
  expect_holds(merge.judge({{0, 1, 2}, {2, 3}, {4}, {4, 5, 6, 7}}, {0, 1, 2, 3}));
  expect_holds(merge.judge({{0, 1, 2, 3}, {4}, {4, 5, 6, 7}}, {0, 2, 3}));     // sharing a particle
  expect_holds(merge.judge({{0, 1, 2}, {2, 3, 4}, {4, 5, 6, 7}}, {0, 1, 3}));  // joined by an edge
  expect_holds(merge.judge({{0, 1, 2}, {2, 3}, {4, 5, 6, 7}}, {0, 1, 3}));     // contained
  expect_holds(merge.judge({{0, 1, 2, 3, 4}, {4, 5, 6, 7}}, {0, 3}));          // three into one
  expect_holds(merge.judge({{0, 1, 2}, {2, 3, 4, 5, 6, 7}}, {0, 3}));
}

TEST(MergeLegality, HoldsOfEveryRuleAlike) {
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published, MergeRule::single_pass}) {
    Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
    merge.pair.setup.merge.rule = rule;
    expect_holds(merge.judge({range(0, 6)}, {0}));
    merge.pair.before.cap = 5;
    expect_rejected(merge.judge({range(0, 6)}, {0}), {0, 1}, {});
  }
}

TEST(MergeLegality, RejectsAnyMergeWhereTheSceneMergesNone) {
  Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
  merge.pair.setup.merge.rule = MergeRule::none;
  expect_holds(merge.judge({{0, 1, 2, 3}, {4, 5}}, {0, 1}));
  expect_rejected(merge.judge({range(0, 6)}, {0}), {}, {});
}

TEST(MergeLegality, RejectsAUnionAboveTheCapButNotAContainedCluster) {
  Merge merge(8, {range(0, 6), {2, 3}, {6, 7}}, 3, 5);
  expect_holds(merge.judge({range(0, 6), {6, 7}}, {0, 2}));
  const Verdict verdict = merge.judge({range(0, 8)}, {0});
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("more than cap = 5"), std::string::npos) << verdict.witness.text;
}

TEST(MergeLegality, RejectsAMergeOfTwoThatDoNotTouch) {
  Merge merge(8, {{0, 1, 2, 3, 4}, {6, 7}, {5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3, 4, 6, 7}, {5}}, {0, 2}), {0, 1}, {0, 6});
  expect_holds(merge.judge({range(0, 8)}, {0}));  // through the one between them
}

TEST(MergeLegality, RejectsAMergeAcrossACut) {
  Merge merge(5, {{0, 1}, {3, 4}}, 3, 8);
  remove_particles(merge.pair.before, {2});
  merge.pair.after = merge.pair.before;
  expect_rejected(merge.judge({{0, 1, 3, 4}}, {0}), {0, 1}, {0, 3});
}

TEST(MergeLegality, RejectsAClusterUsedTwice) {
  Merge merge(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3}, {2, 3}, {3, 4, 5}}, {0, 1, 2}), {0}, {3});  // merged and kept
  // Merged into both sides: 3 is new to cluster 0, 2 to cluster 2, and only cluster 1 could explain either.
  const Verdict both = merge.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2});
  EXPECT_FALSE(both.holds);
  EXPECT_EQ(both.witness.clusters, Numbers({0, 2}));
}

TEST(MergeLegality, FindsTheOneAssignmentThatExplainsEverything) {
  // Cluster 1 = {2, 3} lies in both results; 0 needs it to reach 3, and 2 does not because 3 = {1, 2} gives it 2.
  Merge merge(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}, {2}}, 3, 8);
  expect_holds(merge.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2}));
  // Now both need it, but {2, 3} occurs twice.
  Merge twice(6, {{0, 1, 2}, {2, 3}, {3, 4, 5}, {2, 3}}, 3, 8);
  expect_holds(twice.judge({{0, 1, 2, 3}, {2, 3, 4, 5}}, {0, 2}));
}

TEST(MergeLegality, RejectsALostClusterAndALostParticle) {
  Merge merge(6, {{0, 1, 2}, {2, 3, 4}, {4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2}, {2, 3, 4}}, {0, 1}), {2}, {5});
  expect_rejected(merge.judge({{0, 1, 2}, {2, 3}, {4, 5}}, {0, 1, 2}), {1}, {4});
}

TEST(MergeLegality, RejectsAParticleThatNobodyHeld) {
  Merge merge(6, {{0, 1, 2}, {2, 3, 4}, {4, 5}}, 3, 8);
  expect_rejected(merge.judge({{0, 1, 2, 3}, {2, 3, 4}, {4, 5}}, {0, 1, 2}), {0}, {3});
}

TEST(MergeLegality, RejectsMergingAwayAClusterThatIsNotSmall) {
  Merge merge(7, {{0, 1, 2}, {3, 4, 5, 6}}, 3, 8);
  expect_rejected(merge.judge({range(0, 7)}, {0}), {1, 0}, {});
}

TEST(MergeLegality, RejectsATargetThatLostItsNumber) {
  // The small cluster 1 merges into 0, but the union is called 1.
  Merge merge(5, {{0, 1, 2}, {3, 4}}, 3, 8);
  expect_rejected(merge.judge({range(0, 5)}, {1}), {0, 1}, {});
  expect_rejected(merge.judge({range(0, 5)}, {7}), {7}, {});
}

TEST(MergeLegality, RejectsARotationThatIsNotTheTargets) {
  Merge merge(5, {{0, 1, 2}, {3, 4}}, 3, 8);
  (void)merge.judge({range(0, 5)}, {0});
  merge.pair.after.clusters.rotation[0] = turn_about_z(1);
  expect_rejected(merge_legality(merge.pair.setup, merge.pair.before, merge.pair.after), {0}, {});
}

TEST(MergeLegality, AcceptsABodyOfNoneAndOfOneParticle) {
  const Pair none = pair_of(body_of({}), {}, {});
  expect_holds(merge_legality(none.setup, none.before, none.after));
  EXPECT_EQ(merge_legality(none.setup, none.before, none.after).checked, 0);
  Merge one(1, {{0}}, 2, 8);
  expect_holds(one.judge({{0}}, {0}));
  expect_rejected(one.judge({}, {}), {0}, {0});
}

// A merge done at random but by the rules must always be explained; one particle more must not.
TEST(MergeLegality, ExplainsRandomLegalMergesAndNoticesAnExtraParticle) {
  constexpr uint64_t kSeed = 5;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t merges = 0, noticed = 0;
  for (int round = 0; round < 300; ++round) {
    constexpr int32_t kSide = 6;
    Lists sets;
    std::vector<uint8_t> seen(kSide * kSide, 0);
    for (int32_t k = 0; k < 25; ++k) {
      const auto i0 = static_cast<int32_t>(random() % kSide), j0 = static_cast<int32_t>(random() % kSide);
      const auto w = static_cast<int32_t>(1 + random() % 3), h = static_cast<int32_t>(1 + random() % 3);
      std::vector<int32_t> set;
      for (int32_t j = j0; j < std::min(kSide, j0 + h); ++j) {
        for (int32_t i = i0; i < std::min(kSide, i0 + w); ++i) set.push_back(i + kSide * j);
      }
      sets.push_back(set);
    }
    Pair pair = pair_of(block_body(kSide, kSide, 1), sets, sets);
    pair.before.tau = 5;
    pair.before.cap = 12;
    Numbers numbers = range(0, static_cast<int32_t>(sets.size()));
    for (int attempt = 0; attempt < 60; ++attempt) {
      const std::size_t s = random() % sets.size(), t = random() % sets.size();
      if (s == t || sets[s].size() >= 5) continue;
      std::vector<int32_t> both;
      std::set_union(sets[s].begin(), sets[s].end(), sets[t].begin(), sets[t].end(), std::back_inserter(both));
      bool touches = both.size() < sets[s].size() + sets[t].size();
      for (const int32_t a : sets[s]) {
        for (const int32_t b : sets[t]) {
          if (std::abs(a % kSide - b % kSide) + std::abs(a / kSide - b / kSide) == 1) touches = true;
        }
      }
      if (!touches || (both.size() > 12 && both.size() != sets[t].size())) continue;
      sets[t] = both;
      sets.erase(sets.begin() + static_cast<std::ptrdiff_t>(s));
      numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(s));
      ++merges;
    }
    set_clusters(pair.setup, pair.after, sets, numbers);
    const Verdict verdict = merge_legality(pair.setup, pair.before, pair.after);
    EXPECT_TRUE(verdict.holds) << "round " << round << ": " << verdict.witness.text;
    auto& set = sets[random() % sets.size()];
    const auto extra = static_cast<int32_t>(random() % (kSide * kSide));
    if (std::binary_search(set.begin(), set.end(), extra)) continue;
    set.insert(std::lower_bound(set.begin(), set.end(), extra), extra);
    set_clusters(pair.setup, pair.after, sets, numbers);
    noticed += merge_legality(pair.setup, pair.before, pair.after).holds ? 0 : 1;
  }
  EXPECT_GT(merges, 1000);
  EXPECT_GT(noticed, 100);  // not all: the extra particle may make another legal merge
}

// --- Expand ----------------------------------------------------------------------------------------------------------

// A row of six whose edge 2-3 lies in no cluster.
Pair uncovered_row(const Lists& after) { return pair_of(block_body(6, 1, 1), {{0, 1, 2}, {3, 4, 5}}, after); }

TEST(Expansion, AcceptsTheOtherEndOfAnUncoveredEdge) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsAnEdgeLeftUncovered) {
  Pair pair = uncovered_row({{0, 1, 2}, {3, 4, 5}});
  pair.after.edge_covered = true;
  const Verdict verdict = expansion(pair.setup, pair.before, pair.after);
  expect_rejected(verdict, {}, {2, 3});
  EXPECT_EQ(verdict.witness.path, Numbers({2, 3}));
}

TEST(Expansion, RejectsAPromiseThatWasNotMade) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {}, {});
}

TEST(Expansion, RejectsAClusterThatShrank) {
  Pair pair = uncovered_row({{1, 2, 3}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {0});
}

TEST(Expansion, RejectsAJumpOverAGap) {
  Pair pair = uncovered_row({{0, 1, 2, 3, 5}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {5});
}

TEST(Expansion, RejectsASecondLayerUnlessTheDepthAllowsIt) {
  Pair pair = uncovered_row({{0, 1, 2, 3, 4}, {3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {4});
  pair.setup.expand.depth = 2;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsGrowthAcrossACut) {
  // 3 is removed and dead: 4 is no neighbour of anything in cluster 0.
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {4, 5}}, {{0, 1, 2, 4}, {4, 5}});
  remove_particles(pair.before, {3});
  remove_particles(pair.after, {3});
  pair.after.edge_covered = true;
  pair.setup.expand.depth = 3;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {4});
}

TEST(Expansion, RejectsGrowthWithoutNeed) {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {{0, 1, 2, 3}, {2, 3, 4, 5}});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
}

TEST(Expansion, RejectsAnyGrowthWhereEveryEdgeWasCoveredOrNothingExpands) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {3, 4, 5}});
  pair.before.edge_covered = pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
  pair.before.edge_covered = pair.after.edge_covered = false;
  pair.setup.expand.rule = ExpandRule::none;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {3});
  pair.after = pair.before;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
}

TEST(Expansion, RejectsOtherClustersThanBefore) {
  Pair pair = uncovered_row({range(0, 6)});
  pair.after.edge_covered = true;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {1}, {});
}

TEST(Expansion, PublishedFreesSingleIsolatedClustersOnly) {
  Pair pair = uncovered_row({{0, 1, 2, 3}, {2, 3, 4, 5}});
  pair.setup.expand.rule = ExpandRule::published;
  expect_holds(expansion(pair.setup, pair.before, pair.after));
  pair.after = pair.before;
  expect_rejected(expansion(pair.setup, pair.before, pair.after), {0}, {});
  // Two groups of two: each cluster overlaps another, so none may grow, isolated as the groups are.
  Pair groups = pair_of(block_body(6, 1, 1), {{0, 1}, {1, 2}, {3, 4}, {4, 5}}, {{0, 1}, {1, 2}, {3, 4}, {4, 5}});
  groups.setup.expand.rule = ExpandRule::published;
  expect_holds(expansion(groups.setup, groups.before, groups.after));
  set_clusters(groups.setup, groups.after, {{0, 1}, {1, 2, 3}, {3, 4}, {4, 5}}, {0, 1, 2, 3});
  expect_rejected(expansion(groups.setup, groups.before, groups.after), {1}, {3});
}

TEST(Expansion, AcceptsABodyOfNoneAndOfOneParticle) {
  Pair none = pair_of(body_of({}), {}, {});
  none.after.edge_covered = true;
  expect_holds(expansion(none.setup, none.before, none.after));
  Pair one = pair_of(block_body(1, 1, 1), {{0}}, {{0}});
  one.after.edge_covered = true;
  expect_holds(expansion(one.setup, one.before, one.after));
}

// --- Untouched -------------------------------------------------------------------------------------------------------

struct Change {
  const char* what;
  std::function<void(State&)> change;
  std::vector<Stage> allowed;  // stages that may do this
  Numbers clusters = {}, particles = {};
};

TEST(Untouched, AllowsEachStageItsOwnChangesOnly) {
  const std::vector<Stage> all(kStages.begin(), kStages.end());
  const std::vector<Change> changes = {
      {"nothing", [](State&) {}, all},
      {"a position", [](State& s) { s.x[2].y = 7; }, {Stage::step}, {}, {2}},
      {"a velocity", [](State& s) { s.v[3].y = 7; }, {Stage::step}, {}, {3}},
      {"a velocity's sign of zero", [](State& s) { s.v[3].y = -0.0; }, {Stage::step}, {}, {3}},
      {"the impulse", [](State& s) { s.impulse.x = 1; }, {Stage::step}},
      {"a rotation",
       [](State& s) { s.clusters.rotation[1] = turn_about_z(1); },
       {Stage::step, Stage::split, Stage::merge},
       {1}},
      {"a flag", [](State& s) { s.clusters.degenerate[1] = 1; }, {Stage::step, Stage::split, Stage::merge}, {1}},
      {"alive", [](State& s) { s.alive[4] = 0; }, {Stage::detect, Stage::split}, {}, {4}},
      {"removed", [](State& s) { s.removed = {4}; }, {Stage::detect}},
      {"debris", [](State& s) { s.debris = {4}; }, {Stage::split}},
      {"members", [](State& s) { s.clusters.members[2] = 3; }, {Stage::split, Stage::merge, Stage::expand}},
      {"a rest center",
       [](State& s) { s.clusters.rest_center[0].x = 9; },
       {Stage::split, Stage::merge, Stage::expand},
       {0}},
      {"a cluster's mass", [](State& s) { s.clusters.mass[0] = 9; }, {Stage::split, Stage::merge, Stage::expand}, {0}},
      {"a number", [](State& s) { s.clusters.number[1] = 5; }, {Stage::split, Stage::merge}},
      {"edge_covered", [](State& s) { s.edge_covered = true; }, {Stage::expand}},
      {"tau", [](State& s) { s.tau = 3; }, {}},
      {"cap", [](State& s) { s.cap = 3; }, {}},
      {"a skin position", [](State& s) { s.skin.position[0].x = 9; }, {Stage::skin}},
      {"a skin triangle", [](State& s) { s.skin.triangles.pop_back(); }, {Stage::skin}},
      {"a skin owner", [](State& s) { s.skin.owner[0] = 5; }, {Stage::skin}},
      {"the frame", [](State& s) { ++s.frame; }, {Stage::skin}},
      {"the frame, twice", [](State& s) { s.frame += 2; }, {}},
  };
  for (const auto& [what, change, allowed, clusters, particles] : changes) {
    Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {{0, 1, 2}, {2, 3, 4, 5}});
    pair.before.skin = convex_cell_skin(pair.setup, pair.before);
    pair.after = pair.before;
    change(pair.after);
    for (const Stage stage : kStages) {
      const bool may = std::find(allowed.begin(), allowed.end(), stage) != allowed.end();
      const Verdict verdict = untouched(pair.setup, stage, pair.before, pair.after);
      EXPECT_EQ(verdict.holds, may) << what << " by " << name_of(stage) << ": " << verdict.witness.text;
      if (may) continue;
      EXPECT_FALSE(verdict.witness.text.empty());
      if (!clusters.empty()) {
        EXPECT_EQ(verdict.witness.clusters, clusters) << what;
      }
      if (!particles.empty()) {
        EXPECT_EQ(verdict.witness.particles, particles) << what;
      }
    }
  }
}

TEST(Untouched, RejectsAStepThatMovesTheDeadOrKeepsOldRemovals) {
  Pair pair = pair_of(block_body(3, 1, 1), {{0, 1}}, {{0, 1}});
  remove_particles(pair.before, {2});
  pair.after = pair.before;
  expect_rejected(untouched(pair.setup, Stage::step, pair.before, pair.after), {}, {2});
  pair.after.removed = {};
  expect_holds(untouched(pair.setup, Stage::step, pair.before, pair.after));
  pair.after.x[2].x = 8;
  expect_rejected(untouched(pair.setup, Stage::step, pair.before, pair.after), {}, {2});
}

TEST(Untouched, AsksForCompactNumbersAtTheEndOfAFrame) {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {});
  pair.before.clusters.number = {1, 4};
  pair.after = pair.before;
  expect_holds(untouched(pair.setup, Stage::skin, pair.before, pair.after));  // the stage alone
  pair.after.frame = 1;
  expect_rejected(untouched(pair.setup, Stage::skin, pair.before, pair.after), {1}, {});
  pair.after.clusters.number = {0, 1};
  expect_holds(untouched(pair.setup, Stage::skin, pair.before, pair.after));
}

// --- All of them -----------------------------------------------------------------------------------------------------

TEST(StageOracles, SayNotJudgedIfEitherStateIsNotWellFormed) {
  const Pair good = cut_row();
  for (const bool before : {true, false}) {
    Pair pair = good;
    (before ? pair.before : pair.after).clusters.members[0] = -5;
    for (const auto oracle : {detection, split_exactness, merge_legality, expansion}) {
      const Verdict verdict = oracle(pair.setup, pair.before, pair.after);
      EXPECT_FALSE(verdict.holds);
      EXPECT_NE(verdict.witness.text.find("not judged"), std::string::npos);
      EXPECT_NE(verdict.witness.text.find(before ? "before the stage" : "after the stage"), std::string::npos);
    }
  }
}

TEST(StageOracles, SurviveRandomCorruption) {
  constexpr uint64_t kSeed = 13;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t rejected = 0;
  for (int round = 0; round < 4000; ++round) {
    Pair pair = cut_row();
    pair.setup.split.debris = static_cast<int32_t>(random() % 4);
    pair.setup.expand.rule = random() % 2 == 0 ? ExpandRule::edge_cover : ExpandRule::published;
    pair.setup.expand.depth = static_cast<int32_t>(random() % 4);
    pair.setup.detect.criterion = static_cast<Criterion>(random() % 4);
    pair.setup.has_blade = true;
    pair.setup.blade = {1, 1, 0.1, 0};
    pair.setup.blade_moves.assign(4, BladeMove{{}, {{5, 0, 0}, {0, 1, 0}, {0, 0, 1}}, true, 0});
    pair.before.tau = 3;
    pair.before.cap = 6;
    const int count = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < count; ++k) corrupt(random() % 2 == 0 ? pair.before : pair.after, random);
    for (const auto oracle : {detection, split_exactness, merge_legality, expansion}) {
      rejected += oracle(pair.setup, pair.before, pair.after).holds ? 0 : 1;
    }
    for (const Stage stage : kStages) (void)judge_stage(pair.setup, stage, pair.before, pair.after);
  }
  EXPECT_GT(rejected, 4000);
}

TEST(JudgeStage, AcceptsARightSplitAndRejectsAWrongOne) {
  Pair pair = cut_row();
  for (const Verdict& verdict : judge_stage(pair.setup, Stage::split, pair.before, pair.after)) {
    expect_holds(verdict);
    EXPECT_EQ(verdict.stage, Stage::split);
  }
  pair.after.x[0].x = 100;
  int rejected = 0;
  for (const Verdict& verdict : judge_stage(pair.setup, Stage::split, pair.before, pair.after)) {
    if (!verdict.holds) {
      ++rejected;
      EXPECT_EQ(verdict.property, "untouched");
    }
  }
  EXPECT_EQ(rejected, 1);
}

TEST(JudgeStage, AsksForMaximalityAfterMerge) {
  Merge merge(6, {{0, 1, 2, 3}, {4, 5}}, 3, 6);
  const auto fails = [&](const char* property) {
    for (const Verdict& verdict : judge_stage(merge.pair.setup, Stage::merge, merge.pair.before, merge.pair.after)) {
      if (verdict.property == property) return !verdict.holds;
    }
    ADD_FAILURE() << property << " was not judged";
    return false;
  };
  (void)merge.judge({{0, 1, 2, 3}, {4, 5}}, {0, 1});
  EXPECT_TRUE(fails("merge maximality"));
  EXPECT_FALSE(fails("merge legality"));
  (void)merge.judge({range(0, 6)}, {0});
  EXPECT_FALSE(fails("merge maximality"));
}

}  // namespace
}  // namespace cutproof::oracles
