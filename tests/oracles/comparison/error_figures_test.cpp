// Errors where the answer is known by hand, and where something is wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "gpu/backends.h"
#include "oracles/comparison/conservation.h"
#include "oracles/comparison/cut_geometry.h"
#include "oracles/comparison/interpenetration.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/comparison/solver_error.h"
#include "oracles/comparison/time_step_error.h"
#include "oracles/oracles.h"
#include "oracles/surface/surface_distance.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles {
namespace {

using testing::block_body;
using testing::box_clusters;
using testing::convex_cell_skin;
using testing::range;
using testing::setup_of;
using testing::state_of;

// --- Geometry --------------------------------------------------------------------------------------------------------

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
    testing::remove_particles(after, particles);
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

// --- Interpenetration ------------------------------------------------------------------------------------------------

// Two particles that no edge joins, each with a box for a skin.
struct TwoBoxes {
  cutproof::Setup setup = setup_of(testing::body_of({{0, 0, 0}, {5, 0, 0}}, kH));
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

// --- Solver ----------------------------------------------------------------------------------------------------------

struct Moving {
  cutproof::Setup setup;
  State state;
};

// A block of 6³ particles, stretched and twisted by its velocities.
Moving twisted_block(int32_t iterations) {
  Moving scene{setup_of(block_body(6, 6, 6, kH)), {}};
  scene.setup.step.iterations = iterations;
  scene.state = state_of(scene.setup.body, box_clusters(6, 6, 6, 3));
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
    const Vec3 d = scene.state.x[i] - Vec3{3.5 * kH, 3.5 * kH, 3.5 * kH};
    scene.state.v[i] = {-100 * d.z * d.y / kH, 100 * d.z * d.x / kH, 60 * d.z};
  }
  return scene;
}

TEST(SolverError, IsThatOfThePlainIterationAsItIsWrittenDownElsewhere) {
  for (const int32_t iterations : {1, 4, 600}) {
    const Moving scene = twisted_block(iterations);
    const auto judged = reference::make_backend(), exact = reference::make_backend();
    const SolverError error = solver_error(*judged, *exact, scene.setup, scene.state).value();
    const ReferenceSolution answer = reference_solution(scene.setup, scene.state);
    const PlainLimit plain = plain_limit(scene.setup, scene.state, 0, iterations);
    double greatest = 0;
    for (std::size_t i = 0; i < plain.x.size(); ++i) greatest = std::max(greatest, norm(plain.x[i] - answer.x[i]) / kH);
    EXPECT_TRUE(error.by_energy);
    EXPECT_TRUE(error.converged);
    EXPECT_EQ(error.position.count, 216);
    EXPECT_NEAR(error.position.max, greatest, 1e-11);
    EXPECT_NEAR(error.energy.value(), plain.energy.back() / answer.energy - 1, 1e-11);
    EXPECT_EQ(iterations == 600, error.position.max < 1e-11) << error.position.max;
    EXPECT_GE(*error.energy, -1e-12);
  }
}

TEST(SolverError, WithoutAnEnergyIsTheDistanceToTheFixedPoint) {
  Moving scene = twisted_block(4);
  const auto judged = reference::make_backend(), exact = reference::make_backend();
  const SolverError by_energy = solver_error(*judged, *exact, scene.setup, scene.state).value();
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = -1, .friction = 0.5}};  // far away
  const SolverError by_iteration = solver_error(*judged, *exact, scene.setup, scene.state).value();
  EXPECT_FALSE(by_iteration.by_energy);
  EXPECT_FALSE(by_iteration.energy);
  EXPECT_TRUE(by_iteration.converged);
  EXPECT_NEAR(by_iteration.position.max, by_energy.position.max, 2 * kFixedPoint);
  EXPECT_NEAR(by_iteration.position.rms(), by_energy.position.rms(), 2 * kFixedPoint);
  scene.setup.step.solver = Solver::published;
  EXPECT_FALSE(solver_error(*judged, *exact, scene.setup, scene.state)) << "stiffer with every iteration";
}

// --- Time step -------------------------------------------------------------------------------------------------------

// In free fall from rest, n substeps of dt go g dt² n (n + 1) / 2; 8 n of dt / 8 go 7 n / 16 · g dt² less.
TEST(TimeStepError, OfFreeFallIsKnown) {
  cutproof::Setup setup = setup_of(testing::body_of({{0, 0, 0}}, kH), 5);
  setup.step.gravity = {0, 0, -9.81};
  const State state = state_of(setup.body, {{0}});
  const TimeStepError error = time_step_error(reference::make_backend, setup, state, 100);
  ASSERT_EQ(error.position.size(), 5u);
  EXPECT_FALSE(error.first_difference);
  for (std::size_t frame = 0; frame < 5; ++frame) {
    const double n = 4.0 * static_cast<double>(frame + 1);
    const double truth = 7 * n / 16 * 9.81 * 0.004 * 0.004 / kH;
    EXPECT_NEAR(error.position[frame].rms(), truth, 1e-12);
    EXPECT_NEAR(error.position[frame].max, truth, 1e-12);
  }
  EXPECT_NEAR(error.greatest_rms(), 7 * 20.0 / 16 * 9.81 * 0.004 * 0.004 / kH, 1e-12);
  EXPECT_EQ(time_step_error(reference::make_backend, setup, state, 2).position.size(), 2u);
}

// The lower of two particles falls away from the upper one, which is held. After frame 2 (12 substeps) it has gone
// 78 g dt² in the coarse run and 72.75 g dt² in the fine one: εh lies between.
TEST(TimeStepError, EndsAtTheFirstRemovalThatDiffers) {
  cutproof::Setup setup = setup_of(testing::body_of({{0, 0, 0}, {0, 0, 1}}, kH), 5);
  setup.detect.without_blade = true;
  setup.step.gravity = {0, 0, -0.5 * kH / 75 / (0.004 * 0.004)};
  setup.grips = {{{1}, std::vector<uint8_t>(20, 1), std::vector<Vec3>(20)}};
  const State state = state_of(setup.body, {{0}, {1}});
  const TimeStepError error = time_step_error(reference::make_backend, setup, state, 5);
  EXPECT_EQ(error.position.size(), 2u);
  EXPECT_EQ(error.first_difference, 2);
  EXPECT_EQ(error.removed_otherwise, 0);
}

TEST(TimeStepError, MoreSubstepsPassTheSamePlaces) {
  cutproof::Setup setup = setup_of(block_body(2, 2, 2, kH), 1);
  setup.has_blade = true;
  setup.blade = {1, 1, 0, 0};
  // A quarter turn about z in four substeps, and a step aside.
  const auto pose = [](int k) {
    const double a = k * M_PI / 8;
    return BladePose{{0.1 * k, 0, 0}, {std::cos(a), std::sin(a), 0}, {0, 0, 1}};
  };
  for (int k = 0; k < 4; ++k) setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
  setup.grips = {{{3}, {1, 0, 1, 1}, {{0, 0, 0.8}, {}, {0.8, 0, 0}, {}}}};
  const cutproof::Setup finer = with_more_substeps(setup, 8);
  EXPECT_EQ(finer.step.substeps, 32);
  EXPECT_EQ(finer.substep_length[0], 0.0005);
  ASSERT_EQ(finer.blade_moves.size(), 32u);
  for (std::size_t k = 0; k < 32; ++k) {
    const double a = static_cast<double>(k) / 8 * M_PI / 8;
    const BladePose& from = finer.blade_moves[k].from;
    EXPECT_NEAR(norm(from.along - Vec3{std::cos(a), std::sin(a), 0}), 0, 1e-14);
    EXPECT_NEAR(norm(from.back - Vec3{0, 0, 1}), 0, 1e-14);
    EXPECT_NEAR(from.edge.x, 0.1 * static_cast<double>(k) / 8, 1e-14);
    EXPECT_TRUE(k == 0 || from == finer.blade_moves[k - 1].to) << "no gap";
    EXPECT_TRUE(finer.blade_moves[k].down);
  }
  ASSERT_EQ(finer.grips[0].active.size(), 32u);
  Vec3 way;
  int active = 0;
  for (std::size_t k = 0; k < 32; ++k) {
    way += finer.grips[0].displacement[k];
    active += finer.grips[0].active[k];
  }
  EXPECT_EQ(active, 24);
  EXPECT_NEAR(norm(way - Vec3{0.8, 0, 0.8}), 0, 1e-14);
}

// --- Conservation ----------------------------------------------------------------------------------------------------

constexpr int64_t kFrames = 1000;

// A block of 7 × 5 × 4 particles in motion, alone.
Moving free_block(int64_t frames) {
  Moving scene{setup_of(block_body(7, 5, 4, kH)), {}};
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.step.damping = 3;
  scene.setup = free_setup(scene.setup, 0, frames);
  scene.state = state_of(scene.setup.body, box_clusters(7, 5, 4, 3));
  set_in_motion(scene.setup, scene.state);
  return scene;
}

void print(const char* name, const Conservation& c) {
  std::printf(
      "%s, %ld substeps: momentum %.3g m/s per mass (bound %.3g), %.3g of sum m|v|; energy +%.3g (bound %.3g); angular "
      "momentum %.3g\n",
      name, static_cast<long>(c.substeps), c.momentum, c.momentum_bound, c.momentum_relative, c.energy.value_or(-1),
      c.energy_bound, c.angular_momentum);
}

TEST(Conservation, TheReferenceKeepsMomentumAndGainsNoEnergyOver1000Frames) {
  const auto backend = reference::make_backend();
  const Moving scene = free_block(kFrames);
  const Conservation found = conservation(*backend, scene.setup, scene.state);
  print("reference", found);
  EXPECT_EQ(found.substeps, 4 * kFrames);
  EXPECT_LE(found.momentum_relative, 1e-10);
  EXPECT_LE(found.momentum, found.momentum_bound);
  EXPECT_EQ(found.mass, 0);
  EXPECT_LE(found.energy.value(), found.energy_bound);
  EXPECT_GT(found.angular_momentum, 0) << "it was spinning, and implicit Euler damps that";
}

TEST(Conservation, TheKernelsKeepMomentumAndGainNoEnergyOver1000Frames) {
  const auto backend = gpu::make_host_backend();
  const Moving scene = free_block(kFrames);
  const Conservation found = conservation(*backend, scene.setup, scene.state);
  print("host", found);
  EXPECT_EQ(backend->precision(), Precision::binary32);
  EXPECT_LE(found.momentum, found.momentum_bound);
  EXPECT_EQ(found.mass, 0);
  EXPECT_LE(found.energy.value(), found.energy_bound);
}

// A backend that gives every particle a little velocity in every frame.
class Leaking final : public Backend {
 public:
  explicit Leaking(double leak) : leak_(leak) {}
  std::string name() const override { return "leaking"; }
  bool can_run(Span span) const override { return inner_->can_run(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    inner_->run(span);
    auto states = inner_->snapshot();
    for (Vec3& v : states[0].v) v.x += leak_;
    inner_->load(setups_, std::move(states));
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return inner_->report(); }

 private:
  double leak_;
  std::vector<Setup> setups_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
};

TEST(Conservation, ALeakIsSeen) {
  Leaking backend(1e-9);
  const Moving scene = free_block(100);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_NEAR(found.momentum, 100 * 1e-9, 1e-12);
  EXPECT_GT(found.momentum_relative, 1e-10);
  EXPECT_GT(found.momentum, found.momentum_bound);
}

TEST(Conservation, WhatIsNotANumberIsNotConserved) {
  Leaking backend(std::nan(""));
  const Moving scene = free_block(3);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_TRUE(std::isinf(found.momentum));
  EXPECT_TRUE(std::isinf(found.momentum_relative));
  EXPECT_TRUE(std::isinf(found.mass));
  EXPECT_TRUE(std::isinf(found.energy.value()));
  const TimeStepError time_step =
      time_step_error([] { return std::make_unique<Leaking>(std::nan("")); }, scene.setup, scene.state, 3);
  ASSERT_EQ(time_step.position.size(), 1u) << "there is nothing to compare any more";
  EXPECT_TRUE(std::isinf(time_step.greatest_rms()));
  EXPECT_TRUE(std::isinf(solver_error(backend, backend, scene.setup, scene.state)->position.max));
}

TEST(Conservation, GrowingEnergyIsSeen) {
  Leaking backend(1e-3);
  const Moving scene = free_block(100);
  const Conservation found = conservation(backend, scene.setup, scene.state);
  EXPECT_GT(found.energy.value(), found.energy_bound);
  EXPECT_GT(*found.energy, 0.1);
}

TEST(Conservation, AFreeBodyMeetsNothing) {
  cutproof::Setup setup = setup_of(block_body(3, 3, 3, kH), 2);
  setup.substep_length = {0.004, 0.002};
  setup.walls = {{}};
  setup.grips = {{{0}, std::vector<uint8_t>(8, 1), std::vector<Vec3>(8)}};
  setup.step.gravity = {0, 0, -1};
  setup.step.damping = 1;
  const cutproof::Setup free = free_setup(setup, 1, 7);
  EXPECT_EQ(free.substep_length, std::vector<double>(7, 0.002));
  EXPECT_TRUE(free.walls.empty() && free.grips.empty() && !free.has_blade);
  EXPECT_EQ(free.step.gravity, Vec3{});
  EXPECT_EQ(free.step.damping, 0);
  EXPECT_FALSE(needs_detection(free));
}

}  // namespace
}  // namespace cutproof::oracles
