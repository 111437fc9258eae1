// The shape of a cut where it is known by hand, and where it is wrong.
#include "oracles/comparison/cut_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "oracles/surface/surface_distance.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::cut_geometry_test {
namespace {

using tests::block_body;
using tests::convex_cell_skin;
using tests::range;
using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;

// A block of 7 × 4 × 5 particles and a plate that goes down through it at right angles to x, at `place` [h]. The
// particles rest at x = 1, 2, … 7 h, y = 1 … 4 h, z = 1 … 5 h.
struct Cut {
  cutproof::Setup setup;
  State before, after;

  explicit Cut(double place) {
    setup = setup_of(block_body(7, 4, 5, kH), 3);
    setup.has_blade = true;
    setup.blade = {20 * kH, 20 * kH, 0, 0};
    stroke(place, 0, -1);
    before = state_of(setup.body, {range(0, setup.body.particle_count())});
    after = before;
    after.frame = 3;
  }
  // In all frames, one after the other: the edge goes from z = 10 h down to `low` [h] in the substeps from `first` on.
  void stroke(double place, std::size_t first, double low) {
    setup.blade_moves.resize(12);
    const auto pose = [&](std::size_t k) {
      return BladePose{
          {place * kH, 2 * kH, (10 + (low - 10) * static_cast<double>(k) / 12) * kH}, {0, 1, 0}, {0, 0, 1}};
    };
    for (std::size_t k = first; k < 12; ++k) setup.blade_moves[k] = {pose(k), pose(k + 1), true, 0};
  }
  int32_t particle(int32_t i, int32_t j, int32_t k) const { return i + 7 * (j + 4 * k); }
  // Kills particles and makes the skin of the rest.
  void remove(const std::vector<int32_t>& particles) {
    tests::remove_particles(after, particles);
    after.skin = convex_cell_skin(setup, after);
  }
  std::vector<int32_t> layer(int32_t i, int32_t rows = 4) const {
    std::vector<int32_t> particles;
    for (int32_t k = 0; k < 5; ++k) {
      for (int32_t j = 0; j < rows; ++j) particles.push_back(particle(i, j, k));
    }
    return particles;
  }
  CutGeometry geometry() const { return cut_geometry(setup, before, after); }
};

TEST(CutGeometry, OneLayerIsTheLeastThatAPlaneAlongTheGridCosts) {
  for (const double aside : {0.0, 0.3, -0.45}) {
    Cut cut(4 + aside);
    cut.remove(cut.layer(3));
    const CutGeometry geometry = cut.geometry();
    EXPECT_NEAR(geometry.cut_area, 4 * 5, 1e-12) << "the body is 4 h by 5 h across";
    EXPECT_EQ(geometry.lost_volume, 20);
    EXPECT_NEAR(geometry.lost_per_area.value(), 1, 1e-12);
    EXPECT_NEAR(geometry.least_per_area.value(), 1, 1e-12);
    // The new faces are half a spacing from the layer that is gone.
    EXPECT_NEAR(geometry.skin_to_ideal.value(), 0.5 + std::abs(aside), 1e-12);
    EXPECT_NEAR(geometry.skin_rms.value(), std::hypot(0.5, aside), 1e-12) << "half of them lie on either side";
    // The cut's corner is the farthest from the skin, whose edges are cut off there: half a spacing along y and z, and
    // half less what the blade is aside along x. The outermost line runs an eighth of a spacing inside the corner.
    const double across = 0.5 - std::abs(aside);
    EXPECT_NEAR(geometry.ideal_to_skin.value(), std::sqrt(across * across + 2 * 0.375 * 0.375), 1e-12);
    const double truth = std::sqrt(across * across + 0.5);
    EXPECT_LE(truth - geometry.ideal_to_skin.value(), geometry.sampling_ideal);
    EXPECT_EQ(geometry.hausdorff().value(), std::max(*geometry.skin_to_ideal, *geometry.ideal_to_skin));
  }
}

TEST(CutGeometry, TwoLayersCostTwice) {
  Cut cut(4.5);
  auto both = cut.layer(3);
  for (const int32_t i : cut.layer(4)) both.push_back(i);
  cut.remove(both);
  const CutGeometry geometry = cut.geometry();
  EXPECT_NEAR(geometry.lost_per_area.value(), 2, 1e-12);
  EXPECT_NEAR(geometry.least_per_area.value(), 1, 1e-12);
  EXPECT_NEAR(geometry.skin_to_ideal.value(), 1, 1e-12);
}

TEST(CutGeometry, ACutInTheWrongPlaceIsSeen) {
  Cut cut(4);
  cut.remove(cut.layer(1));  // rests at 2 h
  const CutGeometry geometry = cut.geometry();
  EXPECT_NEAR(geometry.skin_to_ideal.value(), 2.5, 1e-12);
  EXPECT_GE(geometry.ideal_to_skin.value(), 1.5);
  EXPECT_LT(geometry.ideal_to_skin.value(), 1.5 + 0.3);
}

TEST(CutGeometry, TissueThatIsLostElsewhereIsSeen) {
  Cut cut(4);
  auto removed = cut.layer(3);
  removed.push_back(cut.particle(6, 0, 2));  // in the middle of an edge of the block, 3 h from the cut
  cut.remove(removed);
  const CutGeometry geometry = cut.geometry();
  EXPECT_NEAR(geometry.lost_per_area.value(), 21.0 / 20, 1e-12);
  EXPECT_GE(geometry.skin_to_ideal.value(), 2.5);
}

TEST(CutGeometry, WhatIsLeftUncutIsSeen) {
  Cut cut(4);
  cut.remove(cut.layer(3, 2));  // y = 3 h and 4 h are not cut
  const CutGeometry geometry = cut.geometry();
  EXPECT_NEAR(geometry.lost_per_area.value(), 0.5, 1e-12);
  // The lines at y = 4.375 h, which lie in the plane between the new faces that end at 2.5 h, x = 4 h.
  EXPECT_GE(geometry.ideal_to_skin.value(), 4.375 - 2.5 - 1e-12);
  EXPECT_LE(geometry.ideal_to_skin.value(), 4.375 - 2.5 + 0.75);
}

TEST(CutGeometry, NothingRemovedHasNoDistance) {
  Cut cut(4);
  cut.remove({});
  const CutGeometry geometry = cut.geometry();
  EXPECT_NEAR(geometry.cut_area, 20, 1e-12);
  EXPECT_EQ(geometry.lost_per_area.value(), 0);
  EXPECT_FALSE(geometry.hausdorff());
}

TEST(CutGeometry, NoCutHasNoArea) {
  Cut cut(4);
  for (BladeMove& move : cut.setup.blade_moves) move.down = false;
  cut.remove(cut.layer(3));
  EXPECT_EQ(cut.geometry().cut_area, 0);
  EXPECT_FALSE(cut.geometry().lost_per_area);
  EXPECT_FALSE(cut.geometry().hausdorff());
  cut.setup.has_blade = false;
  EXPECT_EQ(cut.geometry().cut_area, 0);
}

// The plate goes half way: z from 5.5 h, the top, down to 2.5 h.
TEST(CutGeometry, APartialCutHasThePartOfTheArea) {
  Cut cut(4);
  cut.stroke(4, 0, 2.5);
  cut.remove({});
  EXPECT_NEAR(cut.geometry().cut_area, 4 * 3, 1e-12);
}

TEST(CutGeometry, WhatTheBladePassesTwiceCountsOnce) {
  Cut cut(4);
  const auto down = cut.setup.blade_moves;
  for (std::size_t k = 12; k-- > 0;) cut.setup.blade_moves.push_back({down[k].to, down[k].from, true, 0});
  for (const BladeMove& move : down) cut.setup.blade_moves.push_back({move.from, move.to, true, 1});
  cut.setup.substep_length.assign(9, 0.004);
  cut.after.frame = 9;
  cut.remove(cut.layer(3));
  EXPECT_NEAR(cut.geometry().cut_area, 20, 1e-12);
}

// The same plate, turned by 45° about y: the cut is √2 times as long in x and z. The bounding lines of the cut cost at
// most one cell of lines.
TEST(CutGeometry, AnObliquePlaneHasItsArea) {
  cutproof::Setup setup = setup_of(block_body(30, 4, 20, kH), 1);
  setup.step.substeps = 1;
  setup.has_blade = true;
  setup.blade = {100 * kH, 100 * kH, 0, 0};
  const double c = std::sqrt(0.5);
  const BladePose from = {{35.03 * kH, 2 * kH, 30 * kH}, {0, 1, 0}, {c, 0, c}};
  BladePose to = from;
  to.edge = from.edge - 60 * kH * from.back;
  setup.blade_moves = {{from, to, true, 0}};
  State before = state_of(setup.body, {range(0, setup.body.particle_count())});
  State after = before;
  after.frame = 1;
  const CutGeometry geometry = cut_geometry(setup, before, after);
  const double area = 4 * 20 * std::sqrt(2.0);
  EXPECT_NEAR(geometry.cut_area, area, 2 * 4 * std::sqrt(2.0) / kLinesPerSpacing);
  // Along x every one of the 20 × 4 lines is cut once, and so are those along z.
  EXPECT_NEAR(geometry.least_per_area.value(), 80 / geometry.cut_area, 1e-12);
}

// Planes through a block, one after the other, each by a plate larger than it that goes along itself.
struct Planes {
  cutproof::Setup setup;
  State before, after;

  Planes(Body body, const std::vector<std::pair<Vec3, Vec3>>& points_and_normals) {
    setup = setup_of(std::move(body), static_cast<int64_t>(points_and_normals.size()));
    setup.step.substeps = 1;
    setup.has_blade = true;
    setup.blade = {100 * kH, 100 * kH, 0, 0};
    for (const auto& [point, normal] : points_and_normals) {
      const Vec3 aside = std::abs(normal.x) < 0.7 * norm(normal) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
      Vec3 along = cross(normal, aside);
      along = (1 / norm(along)) * along;
      Vec3 back = cross(along, normal);
      back = (1 / norm(back)) * back;
      const BladePose from = {point + 40 * kH * back, along, back}, to = {point - 40 * kH * back, along, back};
      setup.blade_moves.push_back({from, to, true, static_cast<int32_t>(setup.blade_moves.size())});
    }
    before = state_of(setup.body, {range(0, setup.body.particle_count())});
    after = before;
    after.frame = setup.frame_count();
  }
  double least() const {
    const CutGeometry geometry = cut_geometry(setup, before, after);
    return geometry.least_per_area.value() * geometry.cut_area;
  }
};

// Each crosses 9 × 4 edges. Of the four particles around where they meet, two that lie across from each other serve two
// edges each, in each of 4 layers.
TEST(CutGeometry, TheLeastOfTwoCutsAcrossEachOtherIsNotThatOfOne) {
  const Planes planes(block_body(9, 9, 4, kH), {{{5.5 * kH, 5 * kH, 2 * kH}, {1, 0, 0}},  //
                                                {{5 * kH, 5.5 * kH, 2 * kH}, {0, 1, 0}}});
  EXPECT_NEAR(planes.least(), 36 + 36 - 4 * 2, 1e-9);
}

// Of three planes in any direction through 18 particles: of all 2^18 choices the smallest that touches every edge whose
// ends lie on two sides of one of them.
TEST(CutGeometry, TheLeastIsThatOfAllChoices) {
  std::mt19937_64 random(7);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::set<int> found;
  for (int trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<std::pair<Vec3, Vec3>> planes;
    for (int k = 0; k < 3; ++k) {
      planes.emplace_back(Vec3{number(1, 3) * kH, number(1, 3) * kH, number(1, 2) * kH},
                          Vec3{number(-1, 1), number(-1, 1), number(-1, 1)});
    }
    const Planes cuts(block_body(3, 3, 2, kH), planes);
    std::vector<uint32_t> edges;  // both ends, as bits
    const Body& body = cuts.setup.body;
    const auto side = [&](const std::pair<Vec3, Vec3>& plane, int32_t i) {
      return dot(body.rest_position(i) - plane.first, plane.second) > 0;
    };
    for (int32_t i = 0; i < body.particle_count(); ++i) {
      for (int32_t j = i + 1; j < body.particle_count(); ++j) {
        if (norm(body.rest_position(i) - body.rest_position(j)) > 1.01 * kH) continue;
        const auto between = [&](const auto& plane) { return side(plane, i) != side(plane, j); };
        if (std::any_of(planes.begin(), planes.end(), between)) edges.push_back((1u << i) | (1u << j));
      }
    }
    int least = 18;
    for (uint32_t gone = 0; gone < (1u << 18); ++gone) {
      if (std::popcount(gone) >= least) continue;
      const auto touched = [&](uint32_t edge) { return (edge & gone) != 0; };
      if (std::all_of(edges.begin(), edges.end(), touched)) least = std::popcount(gone);
    }
    EXPECT_NEAR(cuts.least(), least, 1e-9);
    found.insert(least);
  }
  EXPECT_GE(found.size(), 3u) << "the trials are too much alike";
}

// A plate whose edge goes along itself on a circle, upright: it cuts a part of a cylinder.
TEST(CutGeometry, AnArcHasTheAreaOfItsCylinder) {
  cutproof::Setup setup = setup_of(block_body(30, 30, 6, kH), 1);
  setup.step.substeps = 40;
  setup.has_blade = true;
  const double radius = 12 * kH, length = kH;
  setup.blade = {length, 20 * kH, 0, 0};
  const auto pose = [&](int k) {
    const double angle = 0.2 + 1.0 * k / 40;  // from 0.2 to 1.2 radians about (2, 2) h
    return BladePose{{2 * kH + radius * std::cos(angle), 2 * kH + radius * std::sin(angle), -5 * kH},
                     {-std::sin(angle), std::cos(angle), 0},
                     {0, 0, 1}};
  };
  for (int k = 0; k < 40; ++k) setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
  State before = state_of(setup.body, {range(0, setup.body.particle_count())});
  State after = before;
  after.frame = 1;
  // Both ends of the edge are half a spacing farther on the tangent: the plate cuts that much more at either end. They
  // run on a circle that is greater by l² / 8 r, 0.01 h.
  const double area = (12 * 1.0 + 1) * 6;
  EXPECT_NEAR(cut_geometry(setup, before, after).cut_area, area, 0.02 * area);
}

TEST(SurfaceDistance, OfTrianglesAndPoints) {
  const std::vector<std::array<Vec3, 3>> triangles = {{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}},
                                                      {Vec3{9, 9, 9}, Vec3{9, 9, 9}, Vec3{9, 9, 9}}};
  const auto to_both = distances_to(triangles, {{5, 5, 5}}, {{0.25, 0.25, 2}, {5, 5, 4}, {-3, -4, 0}});
  EXPECT_NEAR(to_both[0], 2, 1e-15);
  EXPECT_NEAR(to_both[1], 1, 1e-15);
  EXPECT_NEAR(to_both[2], 5, 1e-15);
  EXPECT_TRUE(std::isinf(distances_to({}, {}, {{0, 0, 0}})[0]));
}

}  // namespace
}  // namespace cutproof::oracles::cut_geometry_test
