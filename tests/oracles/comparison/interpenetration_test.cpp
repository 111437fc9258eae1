// Pieces that stand in each other by a known volume.
#include "oracles/comparison/interpenetration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/oracles/states.h"

namespace cutproof::oracles::interpenetration_test {
namespace {

using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;

// Two particles that no edge joins, each with a box for a skin.
struct TwoBoxes {
  cutproof::Setup setup = setup_of(tests::body_of({{0, 0, 0}, {5, 0, 0}}, kH));
  State state = state_of(setup.body, {{0}, {1}});

  // Each side as 16 × 16 squares.
  void add(int32_t owner, Vec3 low, Vec3 high) {
    constexpr int32_t kSquares = 16;
    Skin& skin = state.skin;
    const auto vertex = [&](int axis, double along, int i, int j) {
      Vec3 p;
      p[axis] = along;
      p[(axis + 1) % 3] = low[(axis + 1) % 3] + (high[(axis + 1) % 3] - low[(axis + 1) % 3]) * i / kSquares;
      p[(axis + 2) % 3] = low[(axis + 2) % 3] + (high[(axis + 2) % 3] - low[(axis + 2) % 3]) * j / kSquares;
      skin.owner.push_back(owner);
      skin.direction.push_back(0);
      skin.reach.push_back(0.5);
      skin.position.push_back(kH * p);
      return static_cast<int32_t>(skin.owner.size()) - 1;
    };
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool upper : {false, true}) {
        const double along = upper ? high[axis] : low[axis];
        for (int i = 0; i < kSquares; ++i) {
          for (int j = 0; j < kSquares; ++j) {
            const int32_t a = vertex(axis, along, i, j), b = vertex(axis, along, i + 1, j);
            const int32_t c = vertex(axis, along, i + 1, j + 1), d = vertex(axis, along, i, j + 1);
            if (upper) {
              skin.triangles.insert(skin.triangles.end(), {{a, b, c}, {a, c, d}});
            } else {
              skin.triangles.insert(skin.triangles.end(), {{a, c, b}, {a, d, c}});
            }
          }
        }
      }
    }
  }
};

TEST(Interpenetration, OfTwoBoxesIsTheBoxThatTheyShare) {
  TwoBoxes boxes;
  boxes.add(0, {0, 0, 0}, {3, 2, 2});
  boxes.add(1, {2.6, 0.3, -1}, {5, 3, 1.2});
  const Interpenetration found = interpenetration(boxes.setup, boxes.state);
  const double truth = 0.4 * 1.7 * 1.2;
  // Nothing is at an angle to the lines, and they divide what is shared evenly.
  EXPECT_NEAR(found.volume, truth, 1e-12);
  EXPECT_LT(found.bound, 1e-9);
}

// Seen along z, a square of side 2 on its corner reaches 0.5 into the other box: a triangle of height 0.5 and base 1.
TEST(Interpenetration, OfATurnedBoxIsWithinItsBound) {
  TwoBoxes boxes;
  boxes.add(0, {0, 0, 0}, {3, 6, 2});
  const std::size_t first = boxes.state.skin.position.size();
  boxes.add(1, {-1, -1, 0}, {1, 1, 2});
  const double c = std::sqrt(0.5);
  for (std::size_t v = first; v < boxes.state.skin.position.size(); ++v) {
    const Vec3 p = boxes.state.skin.position[v];
    boxes.state.skin.position[v] = {c * p.x - c * p.y + (2.5 + std::sqrt(2.0)) * kH, c * p.x + c * p.y + 3.03 * kH,
                                    p.z};
  }
  const Interpenetration found = interpenetration(boxes.setup, boxes.state);
  EXPECT_NEAR(found.volume, 0.5 * 0.5 * 1 * 2, found.bound);
  EXPECT_NEAR(found.volume, 0.5, 0.05);
  EXPECT_LT(found.bound, 2.5);
}

TEST(Interpenetration, OfABoxInsideAnotherIsTheInnerOne) {
  TwoBoxes boxes;
  boxes.add(0, {0, 0, 0}, {4, 4, 4});
  boxes.add(1, {1, 1, 1}, {3, 2.5, 2});
  EXPECT_NEAR(interpenetration(boxes.setup, boxes.state).volume, 2 * 1.5 * 1, 1e-12);
}

TEST(Interpenetration, IsNoneApartAndNoneOfAPieceWithItself) {
  TwoBoxes boxes;
  boxes.add(0, {0, 0, 0}, {3, 2, 2});
  boxes.add(1, {3.01, 0, 0}, {5, 2, 2});
  EXPECT_EQ(interpenetration(boxes.setup, boxes.state).volume, 0);
  TwoBoxes one;
  one.add(0, {0, 0, 0}, {3, 2, 2});
  one.add(0, {2, 0, 0}, {5, 2, 2});
  EXPECT_EQ(interpenetration(one.setup, one.state).volume, 0);
  one.state.skin = {};
  EXPECT_EQ(interpenetration(one.setup, one.state).volume, 0) << "no skin";
}

TEST(Interpenetration, OfABrokenSkinIsNotANumber) {
  for (const int defect : {0, 1, 2}) {
    TwoBoxes boxes;
    boxes.add(0, {0, 0, 0}, {3, 2, 2});
    boxes.add(1, {2.6, 0, 0}, {5, 2, 2});
    if (defect == 0) boxes.state.skin.position[3].y = std::nan("");
    if (defect == 1) boxes.state.skin.owner[3] = 7;
    if (defect == 2) boxes.state.alive[1] = 0;  // the skin of a dead particle belongs to no component
    const Interpenetration found = interpenetration(boxes.setup, boxes.state);
    EXPECT_TRUE(std::isnan(found.volume)) << defect;
    EXPECT_TRUE(std::isinf(found.bound)) << defect;
  }
}

// A hollow is no tissue: nothing is shared with what stands in it.
TEST(Interpenetration, ACavityIsNotInside) {
  TwoBoxes boxes;
  boxes.add(0, {0, 0, 0}, {4, 4, 4});
  boxes.add(0, {1, 1, 1}, {3, 3, 3});
  auto& triangles = boxes.state.skin.triangles;
  for (std::size_t t = triangles.size() / 2; t < triangles.size(); ++t) std::swap(triangles[t][0], triangles[t][1]);
  boxes.add(1, {1.5, 1.5, 1.5}, {2.5, 2.5, 2.5});
  EXPECT_EQ(interpenetration(boxes.setup, boxes.state).volume, 0);
}

}  // namespace
}  // namespace cutproof::oracles::interpenetration_test
