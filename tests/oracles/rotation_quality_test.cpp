// Rotations that are none are rejected, and those that do not fit where their particles are.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::rotation_quality_test {
namespace {

using namespace cutproof::tests;

TEST(RotationQuality, RejectsAReflectionAndNamesItsCluster) {
  const auto setup = setup_of(block_body(4, 4, 4));
  State state = state_of(setup.body, box_clusters(4, 4, 4, 2));
  EXPECT_TRUE(rotation_quality(setup, state).holds);
  EXPECT_EQ(rotation_quality(setup, state).checked, 8);
  state.clusters.number[5] = 5;
  state.clusters.rotation[5] = {{1, 0, 0, 0, 1, 0, 0, 0, -1}};
  const Verdict verdict = rotation_quality(setup, state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{5});
  EXPECT_NE(verdict.witness.text.find("reflection"), std::string::npos);
}

TEST(RotationQuality, RejectsWhatIsNotOrthogonal) {
  const auto setup = setup_of(block_body(4, 4, 4));
  for (const double wrong : {1e-4, -0.5, std::numeric_limits<double>::quiet_NaN()}) {
    State state = state_of(setup.body, box_clusters(4, 4, 4, 2));
    state.clusters.rotation[2](0, 1) += wrong;
    const Verdict verdict = rotation_quality(setup, state);
    EXPECT_FALSE(verdict.holds) << wrong;
    EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{2});
  }
}

// --- Rotations held against positions --------------------------------------------------------------------------------

Mat3 product(const Mat3& a, const Mat3& b) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      result(row, column) = a(row, 0) * b(0, column) + a(row, 1) * b(1, column) + a(row, 2) * b(2, column);
    }
  }
  return result;
}
// About z, then about x; so that no entry stays what it is.
Mat3 turn(double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
  return product({{1, 0, 0, 0, c, -s, 0, s, c}}, {{c, -s, 0, s, c, 0, 0, 0, 1}});
}
// A block of 6 × 4 × 4 particles in eight clusters, each particle moved by an affine map; every rotation is the map's.
struct Turned {
  explicit Turned(const Mat3& by, double stretch = 1) : setup(setup_of(block_body(6, 4, 4))) {
    state = state_of(setup.body, box_clusters(6, 4, 4, 2));
    for (Vec3& x : state.x) x = by * Vec3{stretch * x.x, x.y, x.z};
    for (Mat3& r : state.clusters.rotation) r = by;
  }
  void give_all(const std::function<Mat3(const Mat3&)>& other) {
    for (Mat3& r : state.clusters.rotation) r = other(r);
  }
  Setup setup;
  State state;
};

TEST(RotationMatch, HoldsOfTheBestRotationHoweverTheBodyIsTurnedAndStretched) {
  for (const double degrees : {0.0, 1e-3, 20.0, 90.0, 180.0}) {
    for (const double stretch : {1.0, 0.4, 3.0}) {
      const Turned turned(turn(degrees), stretch);
      for (const StateOracle& oracle : {rotation_fits, rotation_is_best}) {
        const Verdict verdict = oracle(turned.setup, turned.state);
        EXPECT_TRUE(verdict.holds) << verdict.witness.text << " " << degrees << " " << stretch;
        EXPECT_EQ(verdict.checked, turned.state.clusters.count());
      }
    }
  }
}

// Of a cube, whose turns all count alike, half a right angle is the border.
TEST(RotationMatch, AllowsWhatAStepTurnsAndNoMore) {
  const auto setup = setup_of(block_body(3, 3, 3));
  State state = state_of(setup.body, box_clusters(3, 3, 3, 3));
  for (Vec3& x : state.x) x = turn(30) * x;
  for (const double off : {0.0, 1.0, 44.9, 45.1, 90.0, 180.0}) {
    const double c = std::cos(off * std::numbers::pi / 180), s = std::sin(off * std::numbers::pi / 180);
    state.clusters.rotation[0] = product({{c, 0, s, 0, 1, 0, -s, 0, c}}, turn(30));
    const Verdict verdict = rotation_fits(setup, state);
    EXPECT_EQ(verdict.holds, off < 45) << off << " " << verdict.witness.text;
    EXPECT_EQ(rotation_is_best(setup, state).holds, off == 0) << off;
    if (off < 45) continue;
    EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{0});
    EXPECT_NE(verdict.witness.text.find("degrees from the best one for where its 27 particles are"), std::string::npos)
        << verdict.witness.text;
  }
}

TEST(RotationMatch, TellsTheTransposeFromTheBestRotationHoweverLittleTheBodyIsTurned) {
  for (const double degrees : {0.01, 1.0, 20.0, 45.0, 90.0}) {
    Turned turned(turn(degrees));
    turned.give_all(transposed);
    for (const StateOracle& oracle : {rotation_fits, rotation_is_best}) {
      const Verdict verdict = oracle(turned.setup, turned.state);
      EXPECT_FALSE(verdict.holds) << degrees;
      EXPECT_NE(verdict.witness.text.find("transpose"), std::string::npos) << verdict.witness.text;
    }
  }
  // One of them is not all of them: it may be what a step has left.
  Turned one(turn(10));
  one.state.clusters.rotation[2] = transposed(turn(10));
  EXPECT_TRUE(rotation_fits(one.setup, one.state).holds);
  EXPECT_FALSE(rotation_is_best(one.setup, one.state).holds);
}

TEST(RotationMatch, TellsThatNoRotationWasEverTaken) {
  for (const double degrees : {3.0, 4.0, 30.0}) {  // about each of two axes
    Turned turned(turn(degrees));
    turned.give_all([](const Mat3&) { return Mat3{}; });
    const Verdict verdict = rotation_fits(turned.setup, turned.state);
    EXPECT_EQ(verdict.holds, degrees < 3.5) << verdict.witness.text;
    EXPECT_EQ(verdict.witness.text.find("was none ever taken?") == std::string::npos, verdict.holds);
    // One that was taken shows that the others may lag.
    turned.state.clusters.rotation[3] = turn(degrees);
    EXPECT_TRUE(rotation_fits(turned.setup, turned.state).holds);
  }
}

TEST(RotationMatch, NamesTheIdentityAndTheRotationOfAnotherCluster) {
  Turned turned(turn(90));
  turned.give_all([](const Mat3&) { return Mat3{}; });
  Verdict verdict = rotation_fits(turned.setup, turned.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("every rotation is the identity"), std::string::npos) << verdict.witness.text;
  // Two halves, turned against each other; two rotations have changed places.
  Turned halves(turn(0));
  std::swap(halves.state.clusters.rotation.front(), halves.state.clusters.rotation.back());
  for (const int32_t i : halves.state.clusters.of(0))
    halves.state.x[static_cast<std::size_t>(i)] = turn(100) * halves.state.x[static_cast<std::size_t>(i)];
  halves.state.clusters.rotation.back() = turn(100);
  verdict = rotation_fits(halves.setup, halves.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("it is the"), std::string::npos) << verdict.witness.text;
}

// A sheet pressed flat into a line, a pair, a single particle: what turns freely may be anything, what does not may
// not.
TEST(RotationMatch, AsksOfADegenerateClusterNoMoreThanItsParticlesTell) {
  const auto setup = setup_of(block_body(5, 1, 1));
  State state = state_of(setup.body, {{0, 1, 2, 3}, {3, 4}, {4}});
  const Mat3 about_x = {{1, 0, 0, 0, -1, 0, 0, 0, -1}};
  state.clusters.rotation = {about_x, about_x, {{-1, 0, 0, 0, 1, 0, 0, 0, -1}}};
  for (const StateOracle& oracle : {rotation_fits, rotation_is_best}) {
    const Verdict verdict = oracle(setup, state);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
    EXPECT_EQ(verdict.checked, 2) << "of a single particle nothing is known";
  }
  state.clusters.rotation[1] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  const Verdict verdict = rotation_fits(setup, state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{1});
  // Where all particles are at one place nothing is asked at all.
  state.x.assign(state.x.size(), Vec3{1, 2, 3});
  EXPECT_TRUE(rotation_fits(setup, state).holds);
  EXPECT_EQ(rotation_fits(setup, state).checked, 0);
}

}  // namespace
}  // namespace cutproof::oracles::rotation_quality_test
