// Detection: removed is what the criterion demands, up to rounding.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "model/at.h"
#include "oracles/open_edges.h"
#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::detect_test {
namespace {

using namespace cutproof::tests;

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

// Six digits, and more only where they would not tell a distance from its limit.
TEST(Detection, SaysHowFarNeighboursAreInFewDigits) {
  Pair pair = pulled(1.4);
  pair.before.x[1].x += 1e-12;
  pair.after.x = pair.before.x;
  remove_particles(pair.after, {1});
  EXPECT_EQ(detection(pair.setup, pair.before, pair.after).witness.text,
            "particle 1 was removed, but should not have been: it is 1 h from its farthest neighbour, and edges beyond "
            "1.5 times their rest length are cut");
  const Pair over = pulled(1.5 * (1 + 1e-13));
  EXPECT_NE(detection(over.setup, over.before, over.after).witness.text.find("it is 1.500000000000"), std::string::npos)
      << detection(over.setup, over.before, over.after).witness.text;
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

// Of absolute coordinates the rest length is off by both of its ends: by 2 ε 2⁻²⁴ of a distance of 1,000 here.
TEST(Detection, KnowsRestLengthsAsWellAsCoordinatesAtRest) {
  for (const bool removes : {false, true}) {
    for (const auto& [off, only_one] : {std::pair{1e-4, false}, {3e-4, true}}) {
      for (const double sign : {-1.0, 1.0}) {
        Pair pair = pulled(1.5 + sign * off);
        for (State* const state : {&pair.before, &pair.after}) {
          state->precision = Precision::binary32;
          state->place_rounding = 1000 * 0x1p-24;
        }
        if (removes) remove_particles(pair.after, {2, 3});
        EXPECT_EQ(detection(pair.setup, pair.before, pair.after).holds, !only_one || removes == (sign > 0));
      }
    }
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

// --- One end of each edge ---

Pair one_end(Pair pair) {
  pair.setup.detect.remove = RemovedEnds::one;
  return pair;
}
bool accepts(Pair pair, std::vector<int32_t> gone) {
  remove_particles(pair.after, gone);
  return detection(pair.setup, pair.before, pair.after).holds;
}

TEST(DetectionOfOneEnd, AcceptsOnlyTheLowerOfTwoThatAreAlike) {
  const Pair pair = one_end(pulled(1.6));
  EXPECT_TRUE(accepts(pair, {2}));
  for (const std::vector<int32_t>& gone : {std::vector<int32_t>{}, {3}, {2, 3}, {0, 2}}) {
    EXPECT_FALSE(accepts(pair, gone));
  }
  Pair none = pair;
  expect_rejected(detection(none.setup, none.before, none.after), {}, {2, 3});
  Pair wrong = pair;
  remove_particles(wrong.after, {1, 2});
  expect_rejected(detection(wrong.setup, wrong.before, wrong.after), {}, {1});
}

TEST(DetectionOfOneEnd, AcceptsOnlyTheOneWithMoreOpenEdges) {
  Pair pair = one_end(pulled(1.6));  // 2 → 3, and 1 → 2 now too
  pair.before.x[0].x -= 0.6;
  pair.before.x[1].x -= 0.6;
  pair.after.x = pair.before.x;
  EXPECT_TRUE(accepts(pair, {2}));
  for (const std::vector<int32_t>& gone : {std::vector<int32_t>{1}, {3}, {1, 3}, {1, 2}})
    EXPECT_FALSE(accepts(pair, gone));
}

TEST(DetectionOfOneEnd, AcceptsOnlyTheEndOnTheBladesNegativeSide) {
  Pair pair = one_end(pulled(1.6));
  pair.setup.has_blade = true;
  pair.setup.blade = {1, 1, 0, 0};
  const auto stand = [&](double x, double along) {
    const BladePose pose = {{x, 1, 1}, {0, along, 0}, {0, 0, 1}};  // its normal is along x
    pair.setup.blade_moves.assign(static_cast<std::size_t>(pair.setup.step.substeps), BladeMove{pose, pose, true, 0});
  };
  const double between = pair.before.x[2].x + 0.8;
  stand(between, -1);
  EXPECT_TRUE(accepts(pair, {3}));
  EXPECT_FALSE(accepts(pair, {2}));
  EXPECT_FALSE(accepts(pair, {2, 3}));
  stand(between, 1);
  EXPECT_TRUE(accepts(pair, {2}));
  EXPECT_FALSE(accepts(pair, {3}));
  // Beside both ends, and up: as without one.
  stand(between + 5, -1);
  EXPECT_TRUE(accepts(pair, {2}));
  EXPECT_FALSE(accepts(pair, {3}));
  stand(between, -1);
  for (BladeMove& move : pair.setup.blade_moves) move.down = false;
  EXPECT_TRUE(accepts(pair, {2}));
  EXPECT_FALSE(accepts(pair, {3}));
  // In the plane of an end rounding decides on which side it is, and 1e-13 away not any more.
  for (const double off : {0.0, 1e-13, -1e-13}) {
    stand(pair.before.x[3].x + off, -1);
    EXPECT_EQ(accepts(pair, {2}), off >= 0) << off;  // 3 is on the positive side, that of 2: as without a blade
    EXPECT_EQ(accepts(pair, {3}), off <= 0) << off;
    EXPECT_FALSE(accepts(pair, {2, 3})) << "one of the two is right, and never both";
  }
}

// The same row, one cluster that is not turned, carries its particles h from each other, wherever they are themselves.
// Of the edge from 2 to 3, across which the blade stands, the negative end goes until the other is nearer by h/8.
TEST(DetectionOfNearerEnd, AcceptsOnlyTheNegativeEndUntilTheOtherIsNearerByAnEighth) {
  Pair pair = pulled(1.6);
  pair.setup.detect.remove = RemovedEnds::nearer;
  pair.setup.has_blade = true;
  pair.setup.blade = {1, 1, 0, 0};
  double middle = 0;  // of 2 and 3, as they are carried
  for (const int32_t i : {0, 1, 2, 3}) {
    middle += (pair.before.x[at(i)].x - pair.setup.body.rest_position(i).x) / 4;
    if (i >= 2) middle += pair.setup.body.rest_position(i).x / 2;
  }
  ASSERT_GT(std::abs(middle - (pair.before.x[2].x + pair.before.x[3].x) / 2), 0.1) << "not where the ends are";
  const auto removes = [&](double x, double along, int32_t end, Precision precision = Precision::binary64) {
    const BladePose pose = {{x, 1, 1}, {0, along, 0}, {0, 0, 1}};
    Pair at_blade = pair;
    at_blade.setup.blade_moves.assign(at(pair.setup.step.substeps), BladeMove{pose, pose, true, 0});
    at_blade.before.precision = at_blade.after.precision = precision;
    return accepts(at_blade, {end});
  };
  for (const double along : {1.0, -1.0}) {
    const int32_t negative = along > 0 ? 2 : 3, positive = 5 - negative;
    const double limit = middle + along * kNearerBy / 2;
    for (const double nearer : {-0.2, -1e-12, 1e-12, 0.2}) {
      const int32_t right = nearer > 0 ? positive : negative;
      EXPECT_TRUE(removes(limit + along * nearer, along, right)) << along << ' ' << nearer;
      EXPECT_FALSE(removes(limit + along * nearer, along, 5 - right)) << along << ' ' << nearer;
    }
    // What rounding leaves open: either.
    for (const int32_t end : {2, 3}) {
      EXPECT_TRUE(removes(limit, along, end)) << along;
      EXPECT_TRUE(removes(limit + 1e-7, along, end, Precision::binary32)) << along;
      EXPECT_EQ(removes(limit + along * 1e-4, along, end, Precision::binary32), end == positive) << along;
    }
  }
  // With `one` the negative end goes wherever between them the blade stands.
  pair.setup.detect.remove = RemovedEnds::one;
  EXPECT_TRUE(removes(middle + 0.3, 1, 2));
  EXPECT_FALSE(removes(middle + 0.3, 1, 3));
}

// Where nobody knows the rotations, either end may be the nearer one, but one of them it is, and that is counted.
TEST(DetectionOfNearerEnd, CountsWhatUnknownRotationsLeaveOpen) {
  Pair pair = pulled(1.6);
  pair.setup.detect.remove = RemovedEnds::nearer;
  pair.setup.has_blade = true;
  pair.setup.blade = {1, 1, 0, 0};
  const BladePose pose = {{pair.before.x[2].x + 0.3, 1, 1}, {0, 1, 0}, {0, 0, 1}};
  pair.setup.blade_moves.assign(at(pair.setup.step.substeps), BladeMove{pose, pose, true, 0});
  const TissueGraph graph(pair.setup.body, pair.before.alive);
  const auto judged = [&](const std::vector<uint8_t>& gone, bool rotations_are_known) {
    Verdict verdict;
    const std::vector<RotationKnown> known(rotations_are_known ? 0 : at(pair.before.clusters.count()),
                                           RotationKnown::no);
    OneEndOfEach(pair.setup, graph, pair.before, known).judge(gone, verdict);
    return verdict;
  };
  const std::vector<uint8_t> negative = {0, 0, 1, 0}, positive = {0, 0, 0, 1};
  EXPECT_NE(judged(negative, true).holds, judged(positive, true).holds);
  EXPECT_EQ(judged(negative, true).inconclusive, 0);
  for (const std::vector<uint8_t>& gone : {negative, positive}) {
    EXPECT_TRUE(judged(gone, false).holds);
    EXPECT_EQ(judged(gone, false).inconclusive, 1);
  }
  for (const std::vector<uint8_t>& gone : std::vector<std::vector<uint8_t>>{{0, 0, 0, 0}, {0, 0, 1, 1}, {0, 1, 1, 0}}) {
    EXPECT_FALSE(judged(gone, false).holds);
  }
}

// Two edges at particle 2, both at the limit to rounding: their four choices give {}, {1}, {2}; no one gives {1, 2} or
// {3}.
TEST(DetectionOfOneEnd, AcceptsWhatOneChoiceOfRoundingGivesAndNothingElse) {
  Pair pair = one_end(pulled(1.5));
  pair.before.x[0].x -= 0.5;
  pair.before.x[1].x -= 0.5;
  pair.after.x = pair.before.x;
  for (const std::vector<int32_t>& gone : {std::vector<int32_t>{}, {1}, {2}}) EXPECT_TRUE(accepts(pair, gone));
  for (const std::vector<int32_t>& gone : {std::vector<int32_t>{3}, {1, 2}, {2, 3}, {1, 3}, {0}}) {
    EXPECT_FALSE(accepts(pair, gone));
  }
  // With the second one beyond doubt: 2, whatever the first is.
  pair.before.x[3].x += 1e-13;
  EXPECT_TRUE(accepts(pair, {2}));
  EXPECT_FALSE(accepts(pair, {}));
  EXPECT_FALSE(accepts(pair, {1}));
}

// A long row with every edge at the limit: too much to try, so every particle must have an explanation of its own, and
// counts as inconclusive. What no choice gives is rejected still.
TEST(DetectionOfOneEnd, CountsWhatItCannotTryAsUndecided) {
  constexpr int32_t kLong = 40;
  Pair pair = one_end(pair_of(block_body(kLong, 1, 1), {range(0, kLong)}, {range(0, kLong)}));
  pair.setup.detect.without_blade = true;
  for (int32_t i = 0; i < kLong; ++i) pair.before.x[static_cast<std::size_t>(i)].x = 1.5 * i;
  pair.after.x = pair.before.x;
  Pair all = pair;
  remove_particles(all.after, range(0, kLong - 1));  // all edges are open
  const Verdict verdict = detection(all.setup, all.before, all.after);
  expect_holds(verdict);
  EXPECT_EQ(verdict.inconclusive, kLong);
  EXPECT_TRUE(accepts(pair, {}));
  EXPECT_FALSE(accepts(pair, {kLong - 1})) << "it is never the lower end";
  // One edge of them is open beyond doubt, so it must lose an end.
  for (std::size_t i = 20; i < kLong; ++i) pair.before.x[i].x += 0x1p-40;
  pair.after.x = pair.before.x;
  EXPECT_FALSE(accepts(pair, {}));
  EXPECT_TRUE(accepts(pair, {19}));
}

// In a block of which every edge is at the limit a particle inside hangs on more than can be tried. It is asked all the
// same what no choice can change.
TEST(DetectionOfOneEnd, AsksBluntlyWhereAParticleAloneHangsOnTooMuch) {
  Pair pair = one_end(pair_of(block_body(5, 5, 5), {range(0, 125)}, {range(0, 125)}));
  pair.setup.detect.without_blade = true;
  for (Vec3& x : pair.before.x) x = 1.5 * x;
  pair.after.x = pair.before.x;
  const Verdict none = detection(pair.setup, pair.before, pair.after);
  expect_holds(none);
  EXPECT_EQ(none.inconclusive, 125);
  EXPECT_TRUE(accepts(pair, range(0, 124)));
  // The middle is pulled out of its place: all its edges are too long, nobody has more, and it is lower than some.
  pair.before.x[62] += Vec3{0, 0, 9};
  pair.after.x = pair.before.x;
  EXPECT_TRUE(accepts(pair, {62}));
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {62, 37});
  std::vector<int32_t> others = range(0, 125);
  others.erase(others.begin() + 62);
  EXPECT_FALSE(accepts(pair, others)) << "no edge of it keeps both ends, and it should have gone all the same";
}

// Against the rule written once more, on random bodies: what it says is accepted, and with any one particle turned
// around it is not.
TEST(DetectionOfOneEnd, RejectsEverySingleParticleThatIsOtherwise) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  int64_t removed = 0;
  for (int round = 0; round < 8; ++round) {
    Pair pair = one_end(pair_of(block_body(5, 4, 3), {range(0, 60)}, {range(0, 60)}));
    const Body& body = pair.setup.body;
    for (Vec3& x : pair.before.x) x += 0.25 * Vec3{normal(random), normal(random), normal(random)};
    pair.after.x = pair.before.x;
    pair.setup.has_blade = true;
    pair.setup.blade = {1, 1, 0, 0};
    const BladePose pose = {{3.1, 2.2, 2.3}, {0, 0.6, 0.8}, {0, -0.8, 0.6}};
    pair.setup.blade_moves.assign(static_cast<std::size_t>(pair.setup.step.substeps),
                                  BladeMove{pose, pose, round % 2 == 0, 0});
    const auto is_open = [&](int32_t i, int32_t j) { return norm(pair.before.x[at(i)] - pair.before.x[at(j)]) > 1.5; };
    const auto count = [&](int32_t i) {
      int open = 0;
      for (const int32_t j : body.neighbours(i)) open += is_open(i, j);
      return open;
    };
    const bool by_nearer = round >= 4;
    if (by_nearer) pair.setup.detect.remove = RemovedEnds::nearer;
    double moved = 0;  // of the one cluster, which is not turned
    for (int32_t i = 0; i < 60; ++i) moved += (pair.before.x[at(i)].x - body.rest_position(i).x) / 60;
    const auto carried = [&](int32_t i) { return std::abs(body.rest_position(i).x + moved - 3.1); };
    const auto goes = [&](int32_t i) {
      const bool negative = round % 2 == 0 && pair.before.x[at(i)].x < 3.1;
      for (const int32_t j : body.neighbours(i)) {
        if (!is_open(i, j)) continue;
        const bool other = round % 2 == 0 && pair.before.x[at(j)].x < 3.1;
        const bool positive_goes = by_nearer && carried(negative ? i : j) > carried(negative ? j : i) + kNearerBy;
        if (negative != other ? negative != positive_goes : std::pair(count(i), -i) > std::pair(count(j), -j)) {
          return true;
        }
      }
      return false;
    };
    std::vector<int32_t> right;
    for (int32_t i = 0; i < 60; ++i) {
      if (goes(i)) right.push_back(i);
    }
    removed += static_cast<int64_t>(right.size());
    EXPECT_TRUE(accepts(pair, right)) << "round " << round;
    for (int32_t i = 0; i < 60; ++i) {
      std::vector<int32_t> wrong = right;
      const auto place = std::lower_bound(wrong.begin(), wrong.end(), i);
      place != wrong.end() && *place == i ? wrong.erase(place) : wrong.insert(place, i);
      EXPECT_FALSE(accepts(pair, wrong)) << "round " << round << ", particle " << i;
    }
  }
  EXPECT_GT(removed, 60);
}

// The row is one cluster, whose stretch along x is known: Σ r x / Σ r² with r = -1.5, -0.5, 0.5, 1.5.
TEST(Detection, ByStrainTakesWholeClustersThatAreStretchedTooMuch) {
  Pair pair = pulled(1.5);  // the last particle by 0.5: 1 + 0.5 · 1.5 / 5 = 1.15
  pair.setup.detect.criterion = Criterion::strain;
  pair.setup.detect.strain = 1.15 * (1 + 1e-9);
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair.after.removed = {0};
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {0});  // nothing died
  pair.after.removed = {};
  remove_particles(pair.after, {0, 1, 2, 3});
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {0, 1});

  pair.setup.detect.strain = 1.15 * (1 - 1e-9);
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair.after = pair.before;
  remove_particles(pair.after, {0, 1, 2});
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {3, 2});
  pair.after = pair.before;
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {0, 1});

  // Within rounding both answers are right, in single precision within more of it.
  pair.setup.detect.strain = 1.15;
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair.setup.detect.strain = 1.15 * (1 - 1e-6);
  EXPECT_FALSE(detection(pair.setup, pair.before, pair.after).holds);
  pair.before.precision = Precision::binary32;
  expect_holds(detection(pair.setup, pair.before, pair.after));
}

// A bar of two clusters that share a particle, the second stretched along the bar so that its last particle is
// `farthest` beyond its place: the field is bent, so what a cluster's stretch is depends on the weights.
Pair bent(double farthest) {
  Pair pair = pair_of(block_body(5, 1, 1), {{0, 1, 2}, {2, 3, 4}}, {{0, 1, 2}, {2, 3, 4}});
  pair.setup.detect.criterion = Criterion::strain;
  pair.setup.detect.without_blade = true;
  pair.setup.detect.strain = 1.2;
  pair.before.x[4].x += farthest;
  pair.after.x = pair.before.x;
  return pair;
}

TEST(Detection, OfStrainDemandsAllOfAClusterThatIsStretchedTooMuchAndNothingElse) {
  Pair pair = bent(1);
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
  remove_particles(pair.after, {2, 3, 4});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair.after.removed = {};
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2});
  Pair other = bent(1);
  remove_particles(other.after, {1, 2, 3, 4});
  expect_rejected(detection(other.setup, other.before, other.after), {}, {1, 2});
  // What turns as a whole is not stretched.
  Pair turned = bent(0);
  for (Vec3& x : turned.before.x) x = {-x.y, x.x, x.z};
  turned.after.x = turned.before.x;
  expect_holds(detection(turned.setup, turned.before, turned.after));
  remove_particles(turned.after, {0});
  expect_rejected(detection(turned.setup, turned.before, turned.after), {}, {0, 1});
}

// Particle 2 lies in two clusters, so each counts half of its mass m. Of the second cluster, at 0, 1 and 2 from it with
// weights 1/2, 1 and 1: the mean is 6/5, Σ w r² = 1/2 · 36/25 + 1/25 + 16/25 = 7/5, Σ w e r = 4/5 d, so the stretch is
// 1 + 4/7 d. With whole masses it would be 1 + d/2.
TEST(Detection, OfStrainCountsWhatClustersShareOnce) {
  const double limit = 0.2 * 7 / 4;
  Pair pair = bent(limit * (1 + 1e-12));
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
  pair = bent(limit * (1 - 1e-12));
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair = bent(limit);  // rounding decides
  expect_holds(detection(pair.setup, pair.before, pair.after));
  remove_particles(pair.after, {2, 3, 4});
  expect_holds(detection(pair.setup, pair.before, pair.after));
  // In single precision, rounding reaches farther, and what lies beyond it still counts.
  pair = bent(limit * (1 + 1e-3));
  pair.before.precision = Precision::binary32;
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
  // Of absolute coordinates 400 spacings away, it is not clear.
  pair.before.place_rounding = 400 * 0x1p-24;
  expect_holds(detection(pair.setup, pair.before, pair.after));
  pair = bent(limit * (1 + 1e-2));
  pair.before.precision = Precision::binary32;
  pair.before.place_rounding = 400 * 0x1p-24;
  expect_rejected(detection(pair.setup, pair.before, pair.after), {}, {2, 3});
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

TEST(Detection, OfAGeometricCutSaysHowNearTheBladeCame) {
  Pair pair = struck(3.2, 0.1);
  const auto text_of = [&](const std::vector<int32_t>& gone) {
    State after = pair.before;
    remove_particles(after, gone);
    return detection(pair.setup, pair.before, after).witness.text;
  };
  EXPECT_EQ(text_of({17, 22}),
            "particle 12 was not removed, but should have been: the blade comes within 0.2 h of it, and "
            "removes particles within 0.5 h");
  EXPECT_EQ(text_of({7, 12, 17, 22}),
            "particle 7 was removed, but should not have been: the blade comes within 1.0198 h of it, and "
            "removes particles within 0.5 h");
  // The same way, while it turns about its edge's axis by a little.
  for (auto& move : pair.setup.blade_moves) move.to.back = {std::sin(1e-4), 0, std::cos(1e-4)};
  EXPECT_NE(text_of({7, 12, 17, 22}).find("comes within 1.01"), std::string::npos) << text_of({7, 12, 17, 22});
  for (auto& move : pair.setup.blade_moves) move.down = false;
  EXPECT_EQ(text_of({7}), "particle 7 was removed, but should not have been: the blade is not down in this frame");
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
      bool is_hit = false, is_miss = false;
      for (const int steps : {20, 1000}) {  // most are decided by few
        double least = std::numeric_limits<double>::infinity();
        for (int k = 0; k <= steps; ++k) {
          const double t = static_cast<double>(k) / steps;
          const Vec3 d = x - t * move.to.edge;
          const Vec3 along = rotated(move.from.along, t), back = rotated(move.from.back, t);
          const double u = std::clamp(dot(d, along), -pair.setup.blade.length / 2, pair.setup.blade.length / 2);
          const double w = std::clamp(dot(d, back), 0.0, pair.setup.blade.depth);
          least = std::min(least, norm(d - u * along - w * back));
        }
        const double doubt = (norm(move.to.edge) + 3.4 * angle) / steps;  // to the nearest sample
        is_hit = least <= reach - 2e-9;
        is_miss = least - doubt > reach + (turns ? 0.1 : 0) + 2e-9;
        if (is_hit || is_miss) break;
      }
      if (is_hit) {
        removed.push_back(i);
        ++hits;
      } else if (is_miss) {
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

}  // namespace
}  // namespace cutproof::oracles::detect_test
