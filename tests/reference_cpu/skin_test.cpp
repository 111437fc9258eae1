// Skin against method.md §8: the case table for all 256 cases and all pairs of cells, the surface for random
// patterns, the positions by hand.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "reference_cpu/reference.h"
#include "reference_cpu/skin_cases.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::skin_test {
namespace {

using namespace cutproof::tests;
using reference::cell_edges;
using reference::skin_cases;
using reference::SkinCase;

Lists singletons(const Body& body) {
  Lists lists;
  for (int32_t p = 0; p < body.particle_count(); ++p) lists.push_back({p});
  return lists;
}

Skin skin_of(const Setup& setup, State state) {
  reference::skin(setup, state);
  return state.skin;
}

// --- The case table ----------------------------------------------------------------------------------------------

using Segment = std::pair<int, int>;  // cell edges, in the direction of the polygon

bool lies_on_face(int edge, int axis, int side) {
  const auto& e = cell_edges()[static_cast<std::size_t>(edge)];
  return (e.low >> axis & 1) == side && (e.high >> axis & 1) == side;
}

// The segments of a case's polygons, or of its triangles, that lie on a face of the cell.
std::vector<Segment> segments_on_face(const std::vector<std::vector<int>>& loops, int axis, int side) {
  std::vector<Segment> segments;
  for (const auto& loop : loops) {
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Segment s = {loop[k], loop[(k + 1) % loop.size()]};
      if (lies_on_face(s.first, axis, side) && lies_on_face(s.second, axis, side)) segments.push_back(s);
    }
  }
  std::sort(segments.begin(), segments.end());
  return segments;
}

std::vector<std::vector<int>> triangle_loops(const SkinCase& skin_case) {
  std::vector<std::vector<int>> loops;
  for (const auto& t : skin_case.triangles) loops.push_back({t[0], t[1], t[2]});
  return loops;
}

// The edge on the opposite face of the cell.
int mirrored(int edge, int axis) {
  const auto& e = cell_edges()[static_cast<std::size_t>(edge)];
  for (int k = 0; k < 12; ++k) {
    const auto& other = cell_edges()[static_cast<std::size_t>(k)];
    if (other.low == (e.low ^ 1 << axis) && other.high == (e.high ^ 1 << axis)) return k;
  }
  return -1;
}

TEST(SkinCases, UseEveryCrossedEdgeInExactlyOnePolygon) {
  for (std::size_t inside = 0; inside < 256; ++inside) {
    std::vector<int> used(12, 0);
    for (const auto& polygon : skin_cases()[inside].polygons) {
      ASSERT_GE(polygon.size(), 3u);
      EXPECT_EQ(polygon.front(), *std::min_element(polygon.begin(), polygon.end()));
      for (const int e : polygon) ++used[static_cast<std::size_t>(e)];
    }
    for (std::size_t e = 0; e < 12; ++e) {
      const bool crossed = (inside >> cell_edges()[e].low & 1) != (inside >> cell_edges()[e].high & 1);
      EXPECT_EQ(used[e], crossed ? 1 : 0) << "case " << inside;
    }
  }
}

TEST(SkinCases, MatchOnTheSharedFaceForEveryPairOfNeighbouringCells) {
  int64_t pairs = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t a = 0; a < 256; ++a) {
      for (std::size_t b = 0; b < 256; ++b) {
        bool agree = true;  // the upper face of a is the lower face of b
        for (int c = 0; c < 8; ++c) {
          if (c >> axis & 1) agree = agree && (a >> c & 1) == (b >> (c ^ 1 << axis) & 1);
        }
        if (!agree) continue;
        ++pairs;
        // Polygons and triangles alike: what a runs along in one direction, b runs along in the other, nothing else.
        for (const bool triangles : {false, true}) {
          const auto of = [&](std::size_t k) {
            return triangles ? triangle_loops(skin_cases()[k]) : skin_cases()[k].polygons;
          };
          const auto upper = segments_on_face(of(a), axis, 1);
          std::vector<Segment> lower;
          for (const Segment& s : segments_on_face(of(b), axis, 0)) {
            lower.push_back({mirrored(s.second, axis), mirrored(s.first, axis)});
          }
          std::sort(lower.begin(), lower.end());
          ASSERT_EQ(upper, lower) << "cases " << a << " and " << b << " along axis " << axis;
        }
      }
    }
  }
  EXPECT_EQ(pairs, 3 * 256 * 16);
}

TEST(SkinCases, SeparateTheInsideCornersOfAnAmbiguousFace) {
  // Case 9: corners 0 = (0,0,0) and 3 = (1,1,0). Two triangles, one round each.
  const auto& polygons = skin_cases()[9].polygons;
  ASSERT_EQ(polygons.size(), 2u);
  for (const auto& polygon : polygons) EXPECT_EQ(polygon.size(), 3u);
  // Its complement separates outside corners no more than it must: one polygon of six.
  ASSERT_EQ(skin_cases()[255 - 9].polygons.size(), 1u);
  EXPECT_EQ(skin_cases()[255 - 9].polygons[0].size(), 6u);
}

TEST(SkinCases, HaveAFanWithoutDiagonalsInFacesWhereAPlainFanWouldFailIn17Cases) {
  std::size_t longest = 0;
  int plain_fan_fails = 0;
  for (const SkinCase& skin_case : skin_cases()) {
    bool plain = true;
    for (std::size_t k = 0; k < skin_case.polygons.size(); ++k) {
      const auto& polygon = skin_case.polygons[k];
      longest = std::max(longest, polygon.size());
      const auto diagonals_in_faces = [&](std::size_t start) {
        int count = 0;
        for (std::size_t d = 2; d + 1 < polygon.size(); ++d) {
          const int a = polygon[start], b = polygon[(start + d) % polygon.size()];
          for (int axis = 0; axis < 3; ++axis) {
            for (int side = 0; side < 2; ++side) count += lies_on_face(a, axis, side) && lies_on_face(b, axis, side);
          }
        }
        return count;
      };
      ASSERT_LT(skin_case.fan_start[k], polygon.size());
      EXPECT_EQ(diagonals_in_faces(skin_case.fan_start[k]), 0);
      plain = plain && diagonals_in_faces(0) == 0;
    }
    plain_fan_fails += !plain;
  }
  EXPECT_EQ(longest, 7u);
  EXPECT_EQ(plain_fan_fails, 17);
}

TEST(SkinCases, JoinOnlyOwnersThatAreConnectedInsideTheCell) {
  for (std::size_t inside = 0; inside < 256; ++inside) {
    Classes corners(8);
    for (const auto& edge : cell_edges()) {
      if ((inside >> edge.low & 1) && (inside >> edge.high & 1)) corners.join(edge.low, edge.high);
    }
    for (const auto& polygon : skin_cases()[inside].polygons) {
      std::set<int32_t> components;
      for (const int e : polygon) {
        const auto& edge = cell_edges()[static_cast<std::size_t>(e)];
        components.insert(corners.label((inside >> edge.low & 1) ? edge.low : edge.high));
      }
      EXPECT_EQ(components.size(), 1u) << "case " << inside;
    }
  }
}

// --- The surface -------------------------------------------------------------------------------------------------

// Every directed edge once, with its reverse; round every vertex a single cycle of triangles.
::testing::AssertionResult is_closed_oriented_manifold(const Skin& skin) {
  std::map<std::pair<int32_t, int32_t>, int32_t> third;  // directed edge -> third vertex of its triangle
  for (const auto& t : skin.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto edge = std::pair(t[k], t[(k + 1) % 3]);
      if (!third.emplace(edge, t[(k + 2) % 3]).second) return ::testing::AssertionFailure() << "an edge is used twice";
    }
  }
  for (const auto& [edge, unused] : third) {
    if (third.count({edge.second, edge.first}) == 0) return ::testing::AssertionFailure() << "an edge is open";
  }
  std::vector<int32_t> degree(skin.owner.size(), 0), start(skin.owner.size(), -1);
  for (const auto& [edge, unused] : third) {
    ++degree[static_cast<std::size_t>(edge.first)];
    start[static_cast<std::size_t>(edge.first)] = edge.second;
  }
  for (std::size_t v = 0; v < degree.size(); ++v) {
    if (degree[v] == 0) return ::testing::AssertionFailure() << "vertex " << v << " has no triangle";
    int32_t steps = 0, at = start[v];
    do {
      at = third.at({static_cast<int32_t>(v), at});
      ++steps;
    } while (at != start[v]);
    if (steps != degree[v]) return ::testing::AssertionFailure() << "vertex " << v << " has two fans";
  }
  return ::testing::AssertionSuccess();
}

double volume(const Skin& skin) {
  double sum = 0;
  const auto at = [&](int32_t v) { return skin.position[static_cast<std::size_t>(v)]; };
  for (const auto& t : skin.triangles) sum += dot(at(t[0]), cross(at(t[1]), at(t[2]))) / 6;
  return sum;
}

TEST(Skin, OfOneParticleIsAnOctahedron) {
  const auto setup = setup_of(body_of({{0, 0, 0}}, 2.0));
  const Skin skin = skin_of(setup, state_of(setup.body, {{0}}));
  EXPECT_EQ(skin.owner, std::vector<int32_t>(6, 0));
  EXPECT_EQ(skin.direction, (std::vector<uint8_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(skin.triangles.size(), 8u);
  EXPECT_TRUE(is_closed_oriented_manifold(skin));
  EXPECT_EQ(skin.position[0], (Vec3{3, 2, 2}));
  EXPECT_EQ(skin.position[5], (Vec3{2, 2, 1}));
  EXPECT_DOUBLE_EQ(volume(skin), 4.0 / 3) << "positive: counter-clockwise seen from outside";
}

TEST(Skin, OfABodyWithoutAliveParticlesIsEmpty) {
  auto setup = setup_of(block_body(2, 2, 2));
  State state = state_of(setup.body, {});
  remove_particles(state, range(0, 8));
  EXPECT_EQ(skin_of(setup, state), Skin{});
  setup = setup_of(body_of({}));
  EXPECT_EQ(skin_of(setup, state_of(setup.body, {})), Skin{});
}

TEST(Skin, IsAClosedOrientedManifoldForRandomPatterns) {
  constexpr uint32_t kSeed = 4000;
  std::mt19937 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  for (int round = 0; round < 600; ++round) {
    const Body body = random_body(random, {6, 6, 6}, 0.05 + 0.9 * (round % 10) / 9);
    const auto setup = setup_of(body);
    const Skin skin = skin_of(setup, state_of(body, singletons(body)));
    ASSERT_TRUE(is_closed_oriented_manifold(skin)) << "seed " << kSeed << ", round " << round;
    if (body.particle_count() > 0) {
      // Half a spacing round a particle makes an octahedron; each pair of neighbours adds more.
      ASSERT_GT(volume(skin), body.particle_count() / 6.0 - 1e-9);
      ASSERT_LT(volume(skin), body.particle_count());
    }

    // Pieces of the skin stay within components of G, and each component has a skin.
    const auto graph = graph_labels(body, std::vector<uint8_t>(body.node.size(), 1));
    std::set<int32_t> with_skin;
    for (const auto& t : skin.triangles) {
      for (const int32_t v : t) {
        const auto label = [&](int32_t vertex) {
          return graph[static_cast<std::size_t>(skin.owner[static_cast<std::size_t>(vertex)])];
        };
        ASSERT_EQ(label(v), label(t[0]));
        with_skin.insert(label(v));
      }
    }
    ASSERT_EQ(with_skin, std::set<int32_t>(graph.begin(), graph.end()));
  }
}

TEST(Skin, HasItsVerticesByOwnerThenDirectionEachOnACrossedEdge) {
  std::mt19937 random(3);
  const Body body = random_body(random, {5, 5, 5}, 0.6);
  const auto setup = setup_of(body);
  State state = state_of(body, singletons(body));
  remove_particles(state, {1, 7, 20});
  const Skin skin = skin_of(setup, state);
  std::vector<std::pair<int32_t, int>> found, expected;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) found.push_back({skin.owner[v], skin.direction[v]});
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t q = body.neighbour(p, direction);
      const bool empty = q < 0 || !state.alive[static_cast<std::size_t>(q)];
      if (state.alive[static_cast<std::size_t>(p)] && empty) expected.push_back({p, direction});
    }
  }
  EXPECT_EQ(found, expected);
}

TEST(Skin, IsExtractedAgainExactlyWhenParticlesWereRemoved) {
  const auto setup = setup_of(block_body(3, 3, 3));
  State state = state_of(setup.body, {range(0, 27)});
  reference::skin(setup, state);
  const Skin whole = state.skin;

  state.skin.triangles.pop_back();  // a mark that shows whether the triangles are made anew
  reference::skin(setup, state);
  EXPECT_EQ(state.skin.triangles.size() + 1, whole.triangles.size());

  remove_particles(state, {0});
  reference::skin(setup, state);
  EXPECT_TRUE(is_closed_oriented_manifold(state.skin));
  EXPECT_EQ(std::count(state.skin.owner.begin(), state.skin.owner.end(), 0), 0);

  state.removed.clear();
  state.debris = {26};
  state.alive[26] = 0;
  reference::skin(setup, state);
  EXPECT_EQ(std::count(state.skin.owner.begin(), state.skin.owner.end(), 26), 0);
}

TEST(Skin, IsNotMadeWhenItIsNotWanted) {
  auto setup = setup_of(block_body(2, 2, 2));
  setup.skin.wanted = false;
  EXPECT_EQ(skin_of(setup, state_of(setup.body, {range(0, 8)})), Skin{});
}

// --- Positions ---------------------------------------------------------------------------------------------------

TEST(Skin, StandsAlphaSpacingsFromTheOwnerAtRest) {
  auto setup = setup_of(block_body(4, 3, 2, 0.5));
  setup.skin.alpha = 0.3;
  const State state = state_of(setup.body, box_clusters(4, 3, 2, 2));
  const Skin skin = skin_of(setup, state);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const auto& e = kDirections[skin.direction[v]];
    const Vec3 expected =
        setup.body.rest_position(skin.owner[v]) + 0.3 * 0.5 * Vec3{1.0 * e[0], 1.0 * e[1], 1.0 * e[2]};
    EXPECT_LT(norm(skin.position[v] - expected), 1e-14);
  }
}

TEST(Skin, LiesWhereTheSurfaceCrossesItsEdgeAndOnCutFacesAlphaAway) {
  auto setup = setup_of(block_body(2, 1, 1, 0.5));
  setup.skin.alpha = 0.3;
  setup.body.surface_crossing.assign(12, 0);
  setup.body.surface_crossing[1] = 64;   // of particle 0 along -x: a quarter
  setup.body.surface_crossing[4] = 240;  // along +z
  setup.body.surface_crossing[6] = 16;   // of particle 1 along +x
  State state = state_of(setup.body, {{0, 1}});
  const auto vertex = [&](int32_t owner, int direction) {
    const Skin skin = skin_of(setup, state);
    for (std::size_t v = 0; v < skin.owner.size(); ++v) {
      if (skin.owner[v] == owner && skin.direction[v] == direction) return skin.position[v];
    }
    return Vec3{-1, -1, -1};
  };
  EXPECT_LT(norm(vertex(0, 1) - Vec3{0.5 - 0.125, 0.5, 0.5}), 1e-15);
  EXPECT_LT(norm(vertex(0, 4) - Vec3{0.5, 0.5, 0.5 + 0.5 * 240 / 256}), 1e-15);
  EXPECT_LT(norm(vertex(0, 5) - Vec3{0.5, 0.5, 0.5 - 0.15}), 1e-15) << "not known";
  EXPECT_LT(norm(vertex(1, 0) - Vec3{1 + 0.5 / 16, 0.5, 0.5}), 1e-15);
  remove_particles(state, {1});
  EXPECT_LT(norm(vertex(0, 0) - Vec3{0.5 + 0.15, 0.5, 0.5}), 1e-15) << "a cut face";
  EXPECT_LT(norm(vertex(0, 1) - Vec3{0.5 - 0.125, 0.5, 0.5}), 1e-15) << "as before the cut";
}

// A row of four particles along x whose third dies beside a blade that stands at x = `plane`, tilted by `tilt` about z.
struct BesideABlade {
  explicit BesideABlade(double plane, double tilt = 0, double alpha = 0.3) : setup(setup_of(block_body(4, 1, 1, 0.5))) {
    setup.skin.alpha = alpha;
    setup.skin.fit_cuts = true;
    setup.has_blade = true;
    setup.blade = {10, 10, 0.1, 0};
    setup.step.substeps = 2;
    setup.substep_length = {0.01};
    // The last substep in which it is lowered counts, and its end.
    const BladePose pose = {{plane * 0.5, 0.5, 0}, {std::sin(tilt), std::cos(tilt), 0}, {0, 0, 1}};
    const BladePose away = {{-70, 0.5, 0}, {0, 1, 0}, {0, 0, 1}};
    setup.blade_moves = {{away, pose, true, 0}, {away, away, false, 0}};
    state = state_of(setup.body, {{0, 1, 2, 3}});
    reference::skin(setup, state);
    remove_particles(state, {2});
    state.clusters = state_of(setup.body, {{0, 1}, {3}}).clusters;
  }
  // Of the vertex that particle 1 or 3 has on its edge to 2.
  double reach(int32_t owner) {
    reference::skin(setup, state);
    for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
      if (state.skin.owner[v] == owner && state.skin.direction[v] == (owner == 1 ? 0 : 1)) return state.skin.reach[v];
    }
    return -1;
  }
  Setup setup;
  State state;
};

TEST(Skin, LiesWhereTheBladeCrossesTheEdgesThatACutHasOpened) {
  constexpr double kExact = 1e-14;
  // The row rests at x = 1, 2, 3, 4 spacings.
  EXPECT_NEAR(BesideABlade(2.4).reach(1), 0.4, kExact);
  EXPECT_NEAR(BesideABlade(2.4).reach(3), 15.0 / 16, kExact) << "the dead one lies between";
  EXPECT_NEAR(BesideABlade(3.4).reach(1), 15.0 / 16, kExact);
  EXPECT_NEAR(BesideABlade(3.4).reach(3), 0.6, kExact);
  EXPECT_NEAR(BesideABlade(2.01).reach(1), 1.0 / 16, kExact) << "not on its owner";
  EXPECT_NEAR(BesideABlade(4.5).reach(1), 15.0 / 16 + 0.5 * (0.3 - 15.0 / 16), kExact) << "farther away";
  EXPECT_NEAR(BesideABlade(5.1).reach(1), 0.3, kExact) << "too far away to be of this blade";
  EXPECT_NEAR(BesideABlade(1.5).reach(1), 1.0 / 16 + 0.5 * (0.3 - 1.0 / 16), kExact) << "behind its owner";
  EXPECT_NEAR(BesideABlade(0.9).reach(1), 0.3, kExact);
  EXPECT_NEAR(BesideABlade(2.4, 0.7).reach(1), 0.4, kExact) << "tilted: in the same point";
  // An edge that is nearly parallel to the plane says little, and one that lies in it nothing.
  EXPECT_NEAR(BesideABlade(2.6, std::acos(0.125)).reach(1), 0.3 + 0.5 * (0.6 - 0.3), 1e-12);
  EXPECT_NEAR(BesideABlade(2.6, std::acos(0.0)).reach(1), 0.3, 1e-12);
}

TEST(Skin, KeepsWhereAnEarlierCutLeftItsVertices) {
  BesideABlade row(2.4);
  ASSERT_NEAR(row.reach(1), 0.4, 1e-14);
  row.setup.blade_moves[0].to.edge.x += 0.1;
  EXPECT_NEAR(row.reach(1), 0.4, 1e-14) << "it is there already";
  row.state.skin = {};
  row.state.removed.clear();
  EXPECT_EQ(row.reach(1), 0.3) << "nobody knows any more";
}

TEST(Skin, LeavesCutFacesAlphaAwayWithoutABladeOrIfTheyAreNotFitted) {
  BesideABlade plain(2.4), raised(2.4), over(2.4);
  plain.setup.skin.fit_cuts = false;
  EXPECT_EQ(plain.reach(1), 0.3);
  raised.setup.blade_moves[0].down = false;
  EXPECT_EQ(raised.reach(1), 0.3);
  over.state.frame = 1;
  EXPECT_EQ(over.reach(1), 0.3) << "the schedule is over";
}

TEST(Skin, FollowsTheAverageOfItsOwnersClusters) {
  // Two particles of masses 1 and 3 at x = 1 and 2. Cluster A holds both, B only the second. Weights: 1 and 3/2 in A,
  // 3/2 in B. They move to x = 1 and y = 4 for the second; A has turned by a quarter about z.
  auto setup = setup_of(block_body(2, 1, 1));
  setup.body.mass = {1, 3};
  State state = state_of(setup.body, {{0, 1}, {1}});
  state.clusters.rotation[0] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  state.x[1] = {1, 4, 1};
  const Skin skin = skin_of(setup, state);
  ASSERT_EQ(skin.owner, (std::vector<int32_t>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1}));
  ASSERT_EQ(skin.direction[5], 0);  // +x of the second particle: X_v = (2.5, 1, 1)
  const double rest_x = (1 * 1 + 1.5 * 2) / 2.5, now_y = (1 * 1 + 1.5 * 4) / 2.5;
  const Vec3 by_a = {1, now_y + (2.5 - rest_x), 1};
  const Vec3 by_b = {1.5, 4, 1};
  EXPECT_LT(norm(skin.position[5] - 0.5 * (by_a + by_b)), 1e-14);
}

TEST(Skin, GoesWithItsParticleIfThatLiesInNoCluster) {
  const auto setup = setup_of(block_body(2, 1, 1));
  State state = state_of(setup.body, {{0}});
  state.x[1] = {9, 9, 9};
  const Skin skin = skin_of(setup, state);
  ASSERT_EQ(skin.owner[5], 1);
  EXPECT_EQ(skin.position[5], (Vec3{9.5, 9, 9}));
}

}  // namespace
}  // namespace cutproof::skin_test
