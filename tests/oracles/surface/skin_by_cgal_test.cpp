// The shape of the skin at rest and its shells, by CGAL.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <string>

#include "oracles/surface/tissue_volume.h"
#include "tests/oracles/skins.h"

namespace cutproof::oracles::skin_by_cgal_test {
namespace {

using namespace cutproof::tests;

TEST(SkinGeometry, RejectsASkinTurnedInsideOut) {
  Scene scene = scene_of(block_nodes({0, 0, 0}, {2, 2, 2}));
  for (auto& t : scene.state.skin.triangles) std::swap(t[0], t[1]);
  EXPECT_TRUE(skin_surface(scene.setup, scene.state).holds) << "it is a closed surface all the same";
  const Verdict verdict = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "0 outward and 1 inward")) << verdict.witness.text;
}

TEST(SkinGeometry, RejectsTrianglesThatIntersect) {
  Scene scene = scene_of(block_nodes({0, 0, 0}, {3, 3, 1}));
  Skin& skin = scene.state.skin;
  // The tip above the middle of the plate changes places with the one below: combinatorially the same surface.
  const int32_t above = vertex_of(skin, 4, 4), below = vertex_of(skin, 4, 5);
  std::swap(skin.direction[static_cast<std::size_t>(above)], skin.direction[static_cast<std::size_t>(below)]);
  EXPECT_TRUE(skin_surface(scene.setup, scene.state).holds);
  const Verdict verdict = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "intersect at rest")) << verdict.witness.text;
  EXPECT_EQ(verdict.witness.triangles.size(), 2u);
  EXPECT_FALSE(verdict.witness.particles.empty());
}

TEST(SkinGeometry, RejectsATriangleWithoutArea) {
  // Above a row of three particles three vertices lie on a line.
  Scene scene = scene_of(block_nodes({0, 0, 0}, {3, 1, 1}));
  const Skin& skin = scene.state.skin;
  // A tetrahedron on these and the one below the middle.
  Skin small;
  for (const int32_t v : {vertex_of(skin, 0, 4), vertex_of(skin, 1, 4), vertex_of(skin, 2, 4), vertex_of(skin, 1, 5)}) {
    small.owner.push_back(skin.owner[static_cast<std::size_t>(v)]);
    small.direction.push_back(skin.direction[static_cast<std::size_t>(v)]);
    small.reach.push_back(0.5);
    small.position.push_back(skin.position[static_cast<std::size_t>(v)]);
  }
  small.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}};
  scene.state.skin = small;
  ASSERT_TRUE(skin_surface(scene.setup, scene.state).holds);
  const Verdict verdict = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "has no area")) << verdict.witness.text;
}

TEST(SkinGeometry, RejectsASkinThatForgetsAComponentOrACavity) {
  Scene two = scene_of({{0, 0, 0}, {3, 0, 0}});
  const Scene one = scene_of({{0, 0, 0}});
  two.state.skin = one.state.skin;
  const Verdict component = skin_geometry(two.setup, two.state);
  EXPECT_FALSE(component.holds);
  EXPECT_TRUE(mentions(component, "1 outward and 0 inward shells, and the tissue has 2 components and 0 cavities"))
      << component.witness.text;

  const auto nodes = block_nodes({0, 0, 0}, {5, 5, 5});
  Scene full = scene_of(nodes);
  const Skin skin = full.state.skin;
  const int32_t middle = 62;
  full.state.alive[middle] = 0;
  const Verdict cavity = skin_geometry(full.setup, full.state);
  EXPECT_FALSE(cavity.holds);
  EXPECT_TRUE(mentions(cavity, "1 components and 1 cavities")) << cavity.witness.text;
}

// A cavity that touches the outside only across an edge of the grid is open by 18 neighbours: no cavity.
TEST(SkinGeometry, CountsCavitiesWith18Neighbours) {
  Scene scene = scene_of(without(block_nodes({0, 0, 0}, {4, 4, 4}), {{1, 1, 1}, {0, 0, 1}}));
  scene.state.skin = scene_of({{0, 0, 0}}).state.skin;  // some sphere: right number of shells, wrong volume
  const Verdict verdict = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "h³")) << verdict.witness.text;  // shells agree, so the volume is what is wrong
}

TEST(SkinGeometry, RejectsASkinOfTheRightShapeAndTheWrongVolume) {
  // The skin of a block without one corner, on a block that has that corner.
  const auto nodes = block_nodes({0, 0, 0}, {3, 3, 3});
  Scene scene = scene_of(nodes);
  State smaller = scene.state;
  smaller.alive[0] = 0;
  // No ambiguous cell: a missing corner cuts each of its cells in one polygon.
  smaller.skin = scene.state.skin = convex_cell_skin(scene.setup, smaller);
  ASSERT_TRUE(skin_geometry(scene.setup, smaller).holds) << skin_geometry(scene.setup, smaller).witness.text;
  const Verdict verdict = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.unit, "h³");
  EXPECT_GT(verdict.measured, 0.4) << "a corner holds about half a cell";
}

TEST(SkinGeometry, KnowsTheVolumeUnderEachVertexOfItsOwn) {
  // One particle whose surface is known: four pyramids above and four below, from the vertices' own distances.
  Scene scene = scene_of({{0, 0, 0}});
  scene.setup.body.surface_crossing = {64, 128, 192, 240, 16, 32};
  scene.state.skin.reach = uncut_reaches(scene.setup, scene.state.skin);
  ASSERT_TRUE(skin_geometry(scene.setup, scene.state).holds) << skin_geometry(scene.setup, scene.state).witness.text;
  const auto sum = [&](int axis) {
    return scene.setup.body.crossing(0, 2 * axis) + scene.setup.body.crossing(0, 2 * axis + 1);
  };
  const VolumeRange volume = tissue_volume(scene.setup, scene.state.skin, [&] {
    std::vector<uint8_t> tissue(static_cast<std::size_t>(scene.setup.body.grid.node_count()), 0);
    tissue[static_cast<std::size_t>(scene.setup.body.node[0])] = 1;
    return tissue;
  }());
  EXPECT_NEAR(volume.low, sum(0) * sum(1) * sum(2) / 6, 1e-15);
  EXPECT_NEAR(volume.high, volume.low, 1e-15);
}

// Which vertices there are, and where they lie on their edges.
Skin skin_at_rest(const cutproof::Setup& setup) {
  Skin skin;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    for (uint8_t d = 0; d < 6; ++d) {
      if (setup.body.neighbour(i, d) >= 0) continue;
      skin.owner.push_back(i);
      skin.direction.push_back(d);
    }
  }
  skin.reach = uncut_reaches(setup, skin);
  return skin;
}

std::vector<uint8_t> tissue_of(const Body& body) {
  std::vector<uint8_t> tissue(static_cast<std::size_t>(body.grid.node_count()), 0);
  for (const int64_t node : body.node) tissue[static_cast<std::size_t>(node)] = 1;
  return tissue;
}

// Balls of which the skin is exact at the grid edges: below the ball's volume by what chords cut off, which goes with
// h². Crossings from the equation of the ball.
TEST(SkinGeometry, OfAFittedBallHoldsItsVolumeToTheSquareOfTheSpacing) {
  double last = 0;
  for (const double radius : {7.1, 14.2, 28.4}) {  // [h]
    const auto side = static_cast<int32_t>(2 * radius + 2);
    const Vec3 middle = {radius + 0.5, radius + 0.4, radius + 0.3};
    std::vector<std::array<int32_t, 3>> nodes;
    for (int32_t k = 0; k < side; ++k) {
      for (int32_t j = 0; j < side; ++j) {
        for (int32_t i = 0; i < side; ++i) {
          if (norm(Vec3{1.0 * i, 1.0 * j, 1.0 * k} - middle) < radius) nodes.push_back({i, j, k});
        }
      }
    }
    cutproof::Setup setup;
    setup.body = scene_of(nodes).setup.body;
    Body& body = setup.body;
    const double h = body.grid.spacing, whole = 4.0 / 3 * std::numbers::pi * radius * radius * radius;
    body.surface_crossing.resize(6 * body.node.size());
    for (std::size_t k = 0; k < body.surface_crossing.size(); ++k) {
      const auto particle = static_cast<int32_t>(k / 6);
      if (body.neighbour(particle, static_cast<int>(k % 6)) >= 0) continue;
      const auto& d = kDirections[k % 6];
      const Vec3 x = body.rest_position(particle) / h - Vec3{1, 1, 1} - middle,
                 e = {1.0 * d[0], 1.0 * d[1], 1.0 * d[2]};
      const double along = dot(x, e), meets = -along + std::sqrt(along * along + radius * radius - dot(x, x));
      body.surface_crossing[k] = static_cast<uint8_t>(
          std::clamp<long>(std::lround(meets * kCrossingSteps), kLeastCrossing, kGreatestCrossing));
    }
    const VolumeRange volume = tissue_volume(setup, skin_at_rest(setup), tissue_of(body));
    const double low = volume.low / whole - 1, high = volume.high / whole - 1;
    EXPECT_LT(high, 0) << "chords";
    if (last != 0) {
      EXPECT_NEAR(last / low, 4, 0.8) << radius;
    }
    last = low;
    std::cout << body.node.size() << " particles: " << 100 * low << " to " << 100 * high << " %\n";
  }
}

TEST(SkinShells, AgreeWithShellsJoinedAtVerticesOnEverySurface) {
  const Property& shells = property_named(surface_properties(), "skin shells");
  for (const auto& nodes : {block_nodes({0, 0, 0}, {2, 2, 2}), without(block_nodes({0, 0, 0}, {3, 3, 3}), {{1, 1, 1}}),
                            std::vector<Node>{{0, 0, 0}, {3, 0, 0}}}) {
    const Scene scene = scene_of(nodes);
    const Verdict verdict = ask(shells, scene.setup, scene.state);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
    EXPECT_GT(verdict.checked, 0);
    const auto counted = skin_shells(scene.state.skin);
    ASSERT_TRUE(counted.has_value());
    EXPECT_EQ(*counted, count_shells(scene.state.skin));
  }
}

TEST(SkinShells, CannotBeCountedWhereTrianglesAreNoSurface) {
  Scene scene = scene_of({{0, 0, 0}});
  scene.state.skin.triangles.push_back(scene.state.skin.triangles.front());
  EXPECT_FALSE(skin_shells(scene.state.skin).has_value());
  const Verdict verdict = ask(property_named(surface_properties(), "skin shells"), scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "cannot be counted")) << verdict.witness.text;
  EXPECT_FALSE(mentions(verdict, "CGAL")) << "it is said to people who need not know of it";
}

TEST(SkinShells, AreVacuousWithoutASkin) {
  Scene scene = scene_of({{0, 0, 0}});
  scene.state.skin = {};
  for (const Property& property : surface_properties()) {
    const Verdict verdict = ask(property, scene.setup, scene.state);
    EXPECT_TRUE(verdict.holds);
    EXPECT_EQ(verdict.checked, 0);
    EXPECT_EQ(verdict.vacuous, "no skin");
  }
}

}  // namespace
}  // namespace cutproof::oracles::skin_by_cgal_test
