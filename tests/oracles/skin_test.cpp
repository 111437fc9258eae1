// The skin: good surfaces are accepted, and surfaces that are broken by hand are rejected with the right witness.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "oracles/shells.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"
#include "tests/oracles/skins.h"

namespace cutproof::oracles::skin_test {
namespace {

using namespace cutproof::tests;

TEST(SkinSurface, AcceptsTheOctahedronOfOneParticle) {
  const Scene scene = scene_of({{0, 0, 0}});
  ASSERT_EQ(scene.state.skin.owner.size(), 6u);
  ASSERT_EQ(scene.state.skin.triangles.size(), 8u);
  expect_all_hold(scene);
  EXPECT_EQ(count_shells(scene.state.skin).outer, 1);
  EXPECT_EQ(count_shells(scene.state.skin).inner, 0);
}

TEST(SkinSurface, AcceptsABlockABlockWithACavityAndTwoBlocks) {
  expect_all_hold(scene_of(block_nodes({0, 0, 0}, {4, 3, 2}), 0.003));
  const Scene hollow = scene_of(without(block_nodes({0, 0, 0}, {5, 5, 5}), block_nodes({2, 2, 2}, {3, 3, 3})));
  expect_all_hold(hollow);
  EXPECT_EQ(count_shells(hollow.state.skin).inner, 1);
  auto two = block_nodes({0, 0, 0}, {2, 2, 2});
  for (const Node& n : block_nodes({4, 0, 0}, {6, 2, 2})) two.push_back(n);
  const Scene apart = scene_of(two);
  expect_all_hold(apart);
  EXPECT_EQ(count_shells(apart.state.skin).outer, 2);
}

TEST(SkinSurface, AcceptsVerticesAnywhereOnTheirEdges) {
  for (const double alpha : {0.1, 0.35, 0.75}) {
    Scene scene = scene_of(block_nodes({0, 0, 0}, {3, 3, 3}));
    scene.setup.skin.alpha = alpha;
    scene.state.skin = convex_cell_skin(scene.setup, scene.state);
    expect_all_hold(scene);
  }
}

// Every skin that the reference makes is a surface, with the volume between bounds that know no case table: all 256
// cells, and random patterns of every density.
TEST(SkinSurface, AcceptsTheReferencesSkinOfAllCellsAndOfRandomPatterns) {
  const auto judge = [](const std::vector<Node>& nodes, const std::string& what) {
    Scene scene{setup_of(body_of(nodes)), {}};
    scene.state = state_of(scene.setup.body, {range(0, scene.setup.body.particle_count())});
    reference::skin(scene.setup, scene.state);
    for (const auto oracle : {skin_surface, skin_geometry, skin_vertices}) {
      const Verdict verdict = oracle(scene.setup, scene.state);
      ASSERT_TRUE(verdict.holds) << what << ": " << verdict.property << ": " << verdict.witness.text;
      ASSERT_GT(verdict.checked, 0) << what;
    }
  };
  for (int pattern = 1; pattern < 256; ++pattern) {
    std::vector<Node> nodes;
    for (int corner = 0; corner < 8; ++corner) {
      if ((pattern >> corner) & 1) nodes.push_back({corner & 1, (corner >> 1) & 1, (corner >> 2) & 1});
    }
    judge(nodes, "cell " + std::to_string(pattern));
  }
  constexpr uint32_t kSeed = 20240611;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 random(kSeed);
  for (int round = 0; round < 100; ++round) {
    std::bernoulli_distribution tissue(0.1 + 0.8 * (round % 9) / 8.0);
    std::vector<Node> nodes;
    for (const Node& n : block_nodes({0, 0, 0}, {6, 6, 6})) {
      if (tissue(random)) nodes.push_back(n);
    }
    judge(nodes, "seed " + std::to_string(kSeed) + ", pattern " + std::to_string(round));
  }
}

TEST(SkinSurface, RejectsAnOpenSkin) {
  Scene scene = scene_of({{0, 0, 0}, {1, 0, 0}});
  const auto gone = scene.state.skin.triangles.back();
  scene.state.skin.triangles.pop_back();
  const Verdict verdict = skin_surface(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "the surface is open"));
  ASSERT_EQ(verdict.witness.triangles.size(), 1u);
  EXPECT_TRUE(mentions(verdict, "triangle " + std::to_string(verdict.witness.triangles[0])));
  std::vector<int32_t> owners;
  for (const int32_t v : gone) owners.push_back(scene.state.skin.owner[static_cast<std::size_t>(v)]);
  for (const int32_t p : verdict.witness.particles) {
    EXPECT_NE(std::find(owners.begin(), owners.end(), p), owners.end()) << "the witness lies on the hole";
  }
  const Verdict geometry = skin_geometry(scene.setup, scene.state);
  EXPECT_FALSE(geometry.holds) << "not judged is not accepted";
  EXPECT_FALSE(could_be_judged(geometry.witness.text)) << geometry.witness.text;
}

TEST(SkinSurface, RejectsAFlippedTriangle) {
  Scene scene = scene_of({{0, 0, 0}});
  std::swap(scene.state.skin.triangles[3][0], scene.state.skin.triangles[3][1]);
  const Verdict verdict = skin_surface(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "both run from vertex"));
  EXPECT_EQ(verdict.witness.triangles.size(), 2u);
  EXPECT_TRUE(mentions(verdict, "3")) << verdict.witness.text;
}

TEST(SkinSurface, RejectsADoubledTriangle) {
  Scene scene = scene_of({{0, 0, 0}});
  scene.state.skin.triangles.push_back(scene.state.skin.triangles[2]);
  const Verdict verdict = skin_surface(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "triangles 2 and 8 both run")) << verdict.witness.text;
}

// Two octahedra made to share one vertex: closed and oriented, every edge with two triangles, but pinched.
TEST(SkinSurface, RejectsAPinchedVertex) {
  Scene scene = scene_of({{0, 0, 0}, {3, 0, 0}});
  Skin& skin = scene.state.skin;
  const int32_t kept = vertex_of(skin, 0, 0), dropped = vertex_of(skin, 1, 1);
  ASSERT_GE(kept, 0);
  ASSERT_GE(dropped, 0);
  const auto renamed = [&](int32_t v) { return v == dropped ? kept : v; };
  for (auto& t : skin.triangles) {
    for (int32_t& v : t) {
      v = renamed(v);
      if (v > dropped) --v;
    }
  }
  const auto at = static_cast<std::ptrdiff_t>(dropped);
  skin.owner.erase(skin.owner.begin() + at);
  skin.direction.erase(skin.direction.begin() + at);
  skin.reach.erase(skin.reach.begin() + at);
  skin.position.erase(skin.position.begin() + at);
  const Verdict verdict = skin_surface(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "pinched")) << verdict.witness.text;
  EXPECT_TRUE(names_particle(verdict, 0));
}

TEST(SkinSurface, RejectsIndicesOutOfRangeRepeatedIndicesAndStrayVertices) {
  const Scene good = scene_of({{0, 0, 0}, {1, 0, 0}});
  const auto rejects = [&](const std::function<void(Skin&)>& breaks, const std::string& text) {
    Scene scene = good;
    breaks(scene.state.skin);
    const Verdict verdict = skin_surface(scene.setup, scene.state);
    EXPECT_FALSE(verdict.holds) << text;
    EXPECT_TRUE(mentions(verdict, text)) << verdict.witness.text;
    EXPECT_FALSE(skin_geometry(scene.setup, scene.state).holds);
    (void)skin_vertices(scene.setup, scene.state);  // must not throw or read out of bounds
    (void)skin_shells(scene.state.skin);
  };
  rejects([](Skin& s) { s.triangles[0][1] = 99; }, "names vertex 99");
  rejects([](Skin& s) { s.triangles[0][1] = -1; }, "names vertex -1");
  rejects([](Skin& s) { s.triangles[0][1] = s.triangles[0][0]; }, "names a vertex twice");
  rejects([](Skin& s) { s.owner[0] = 2; }, "has owner 2");
  rejects([](Skin& s) { s.direction[0] = 6; }, "direction 6");
  rejects([](Skin& s) { s.position.pop_back(); }, "positions");
  rejects(
      [](Skin& s) {
        s.owner.push_back(0);
        s.direction.push_back(0);
        s.reach.push_back(0.5);
        s.position.push_back({});
      },
      "");  // a vertex more: on an edge that has one, or used by no triangle
}

TEST(SkinVertices, RejectsTwoOnOneEdge) {
  Scene scene = scene_of({{0, 0, 0}, {1, 0, 0}});
  Skin& skin = scene.state.skin;
  skin.owner[1] = skin.owner[0];
  skin.direction[1] = skin.direction[0];
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "carries two vertices")) << verdict.witness.text;
}

// Of a skin whose vertices lie anywhere in their cells: shells by where they are now, with owners or without.
TEST(FreeSkinMatch, RejectsAShellTooFewTooManyOrInsideOut) {
  const Scene two = scene_of({{0, 0, 0}, {3, 0, 0}});
  for (const bool owned : {true, false}) {
    const auto judged = [&](const std::function<void(Skin&)>& breaks) {
      Skin skin = two.state.skin;
      breaks(skin);
      if (!owned) skin.owner.clear();
      return free_skin_match(two.setup, two.state, skin);
    };
    EXPECT_TRUE(judged([](Skin&) {}).holds);
    EXPECT_EQ(judged([](Skin&) {}).checked, 2);
    EXPECT_TRUE(judged([](Skin& s) { s.position[0].x += 0.2; }).holds) << "places are free";
    const auto of_second = [&](const std::array<int32_t, 3>& t) { return two.state.skin.owner[at(t[0])] == 1; };
    EXPECT_TRUE(mentions(judged([&](Skin& s) { std::erase_if(s.triangles, of_second); }),
                         "the skin has 1 outer shells, but the tissue has 2 components"));
    const auto turned = [&](bool all) {
      return judged([&](Skin& s) {
        for (auto& t : s.triangles) {
          if (all || of_second(t)) std::swap(t[0], t[1]);
        }
      });
    };
    EXPECT_TRUE(mentions(turned(false), "has 1 outer shells")) << turned(false).witness.text;
    EXPECT_FALSE(turned(true).holds);
  }
  // A cavity's shell and the outer one, both inside out: as many of each as there should be.
  const Scene hollow = [] {
    std::vector<std::array<int32_t, 3>> nodes;
    for (int32_t k = 0; k < 27; ++k) {
      if (k != 13) nodes.push_back({k % 3, k / 3 % 3, k / 9});
    }
    return scene_of(nodes);
  }();
  EXPECT_TRUE(free_skin_match(hollow.setup, hollow.state, hollow.state.skin).holds);
  Skin turned = hollow.state.skin;
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_TRUE(mentions(free_skin_match(hollow.setup, hollow.state, turned), "encloses no tissue"));
}

TEST(SkinSurface, RejectsAMissingSkinOnceAFrameHasEnded) {
  Scene scene = scene_of({{0, 0, 0}});
  scene.state.skin = {};
  EXPECT_TRUE(skin_surface(scene.setup, scene.state).holds) << "no frame has ended yet";
  EXPECT_EQ(skin_surface(scene.setup, scene.state).checked, 0);
  scene.state.frame = 1;
  for (const auto oracle : {skin_surface, skin_geometry, skin_vertices}) {
    EXPECT_FALSE(oracle(scene.setup, scene.state).holds);
  }
  scene.setup.skin.wanted = false;
  EXPECT_TRUE(skin_surface(scene.setup, scene.state).holds);
}

TEST(SkinVertices, FollowTheClustersOfTheirOwners) {
  // Two clusters that share the middle particle of a bar, moved and turned by hand.
  Scene scene = scene_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.5);
  scene.state = state_of(scene.setup.body, {{0, 1}, {1, 2}});
  scene.state.skin = convex_cell_skin(scene.setup, scene.state);
  const Mat3 quarter = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};  // x to y
  scene.state.clusters.rotation[1] = quarter;
  for (Vec3& x : scene.state.x) x += Vec3{3, 4, 5};
  // w = m for the ends and m / 2 for the middle: T_1 lies a third of the way from particle 2 to particle 1.
  const Vec3 x2 = scene.setup.body.rest_position(2);
  const Vec3 center = x2 - Vec3{0.5 / 3, 0, 0};
  for (std::size_t v = 0; v < scene.state.skin.owner.size(); ++v) {
    const Vec3 rest = scene.state.skin.position[v];
    const Vec3 of_0 = rest + Vec3{3, 4, 5};
    const Vec3 of_1 = center + Vec3{3, 4, 5} + quarter * (rest - center);
    const int32_t owner = scene.state.skin.owner[v];
    scene.state.skin.position[v] = owner == 0 ? of_0 : owner == 2 ? of_1 : (of_0 + of_1) / 2;
  }
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.unit, "h");
  EXPECT_LT(verdict.bound, 1e-12);
}

// 400 clusters that agree in nothing but their center: single precision, one partial sum after another, is off by more
// than single operations are.
TEST(SkinVertices, AcceptsWhatTheSumOverManyClustersRounds) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto rounded_rotation = [&] {
    const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
    const double s = 2 / (w * w + x * x + y * y + z * z);
    const auto e = [](double entry) { return static_cast<double>(static_cast<float>(entry)); };
    return Mat3{{e(1 - s * (y * y + z * z)), e(s * (x * y - w * z)), e(s * (x * z + w * y)),  //
                 e(s * (x * y + w * z)), e(1 - s * (x * x + z * z)), e(s * (y * z - w * x)),  //
                 e(s * (x * z - w * y)), e(s * (y * z + w * x)), e(1 - s * (x * x + y * y))}};
  };
  double greatest = 0;
  for (int draw = 0; draw < 20; ++draw) {
    Scene scene = scene_of(block_nodes({0, 0, 0}, {2, 2, 2}));
    scene.state = state_of(scene.setup.body, Lists(400, range(0, 8)));
    scene.state.skin = convex_cell_skin(scene.setup, scene.state);
    scene.state.precision = Precision::binary32;
    for (Mat3& r : scene.state.clusters.rotation) r = rounded_rotation();
    for (Vec3& vertex : scene.state.skin.position) {
      const Vec3 arm = vertex - scene.state.clusters.rest_center[0];
      for (int row = 0; row < 3; ++row) {
        float first = 0, sum = 0;
        for (const Mat3& r : scene.state.clusters.rotation) {
          float turned = -static_cast<float>(arm[row]);
          for (int k = 0; k < 3; ++k) turned += static_cast<float>(r(row, k)) * static_cast<float>(arm[k]);
          if (&r == scene.state.clusters.rotation.data()) first = turned;
          sum += turned - first;
        }
        vertex[row] += first + sum / 400;
      }
    }
    const Verdict verdict = skin_vertices(scene.setup, scene.state);
    EXPECT_TRUE(verdict.holds) << verdict.witness.text;
    greatest = std::max(greatest, verdict.measured / verdict.bound);
  }
  EXPECT_GT(greatest, 0.1);  // no more than rounding needs
}

TEST(SkinVertices, RejectsAVertexThatIsOffByABillionthOfTheSpacing) {
  for (const double volume_share : {0.0, 0.9}) {
    Scene scene = scene_of(block_nodes({0, 0, 0}, {4, 4, 4}));
    scene.setup.step.volume_share = volume_share;
    EXPECT_TRUE(skin_vertices(scene.setup, scene.state).holds);
    scene.state.skin.position[17].y += 1e-9;
    const Verdict verdict = skin_vertices(scene.setup, scene.state);
    EXPECT_FALSE(verdict.holds);
    EXPECT_NEAR(verdict.measured, 1e-9, 1e-12);
    EXPECT_TRUE(names_particle(verdict, scene.state.skin.owner[17]));
    scene.state.skin.position[17].y = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(skin_vertices(scene.setup, scene.state).holds);
  }
}

TEST(SkinReach, IsWhereTheBladeCrossesAnEdgeThatACutHasOpened) {
  // A row of three cut between the second and the third: the third dies, and the blade stands 0.4 h from the second.
  Scene before = scene_of(block_nodes({0, 0, 0}, {3, 1, 1}));
  cutproof::Setup& setup = before.setup;
  setup.skin.fit_cuts = setup.has_blade = true;
  setup.blade = {10, 10, 0, 0};
  const double h = setup.body.grid.spacing;
  const BladePose pose = {setup.body.rest_position(1) + Vec3{0.4 * h, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  setup.substep_length = {0.01};
  setup.blade_moves.assign(static_cast<std::size_t>(setup.step.substeps), {pose, pose, true, 0});
  before.state.frame = 0;
  before.state.alive[2] = 0;
  before.state.removed = {2};
  Clusters& clusters = before.state.clusters;
  clusters.offsets = {0, 2};
  clusters.members = {0, 1};
  clusters.number.resize(1);
  clusters.rotation.resize(1);
  clusters.degenerate.resize(1);
  clusters.rest_center.resize(1);
  clusters.mass.resize(1);
  reference::update_rest_frames(setup.body, clusters);
  State after = before.state;
  reference::skin(setup, after);
  after.frame = 1;
  const auto verdict_of = [&] { return skin_reach(setup, before.state, after); };
  const auto v = static_cast<std::size_t>(vertex_of(after.skin, 1, 0));
  const auto old = static_cast<std::size_t>(vertex_of(after.skin, 0, 1));
  ASSERT_TRUE(verdict_of().holds) << verdict_of().witness.text;
  EXPECT_EQ(verdict_of().checked, 10);
  EXPECT_NEAR(after.skin.reach[v], 0.4, 1e-12);
  after.skin.reach[v] += 1e-12;
  EXPECT_FALSE(verdict_of().holds) << "bound " << verdict_of().bound;
  EXPECT_TRUE(names_particle(verdict_of(), 1));
  for (const double wrong : {0.5, 0.6, 1.0 / 16, 15.0 / 16}) {
    after.skin.reach[v] = wrong;
    EXPECT_FALSE(verdict_of().holds) << wrong;
    EXPECT_NEAR(verdict_of().measured, std::abs(wrong - 0.4), 1e-9);
  }
  after.skin.reach[v] = 0.4;
  ASSERT_TRUE(verdict_of().holds);
  // What was there stays, whatever it is.
  before.state.skin.reach[static_cast<std::size_t>(vertex_of(before.state.skin, 0, 1))] = 0.7;
  EXPECT_FALSE(verdict_of().holds) << "it was at 0.7";
  after.skin.reach[old] = 0.7;
  EXPECT_TRUE(verdict_of().holds);
  // Not beside what had died before, and not if nothing is fitted.
  before.state.removed.clear();
  EXPECT_FALSE(verdict_of().holds);
  after.skin.reach[v] = setup.skin.alpha;
  EXPECT_TRUE(verdict_of().holds);
  before.state.removed = {2};
  EXPECT_FALSE(verdict_of().holds);
  setup.skin.fit_cuts = false;
  EXPECT_TRUE(verdict_of().holds);
}

TEST(SkinVertices, RejectsAVertexThatIgnoresWhereTheSurfaceCrossesItsEdge) {
  Scene scene = scene_of(block_nodes({0, 0, 0}, {3, 3, 3}));
  ASSERT_TRUE(skin_vertices(scene.setup, scene.state).holds);
  scene.setup.body.surface_crossing.assign(6 * 27, 0);
  scene.setup.body.surface_crossing[1] = 128;  // where it lies anyway
  EXPECT_TRUE(skin_vertices(scene.setup, scene.state).holds);
  scene.setup.body.surface_crossing[1] = 129;
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds) << "one step of the crossing away";
  EXPECT_NEAR(verdict.measured, 1.0 / 256, 1e-12);
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{0});
}

TEST(SkinVertices, RejectsAnOwnerThatIsDead) {
  Scene scene = scene_of({{0, 0, 0}, {1, 0, 0}});
  scene.state.alive[1] = 0;
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "which is dead"));
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{1});
}

TEST(SkinVertices, RejectsAVertexBetweenTwoAliveParticles) {
  Scene scene = scene_of({{0, 0, 0}, {1, 0, 0}});
  const auto v = static_cast<std::size_t>(vertex_of(scene.state.skin, 0, 1));
  scene.state.skin.direction[v] = 0;
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "both are alive"));
  EXPECT_EQ(verdict.witness.particles, (std::vector<int32_t>{0, 1}));
}

TEST(SkinVertices, RejectsACrossedEdgeWithoutVertex) {
  Scene scene = scene_of({{0, 0, 0}, {3, 0, 0}});
  const Skin one = scene_of({{0, 0, 0}}).state.skin;
  scene.state.skin = one;
  const Verdict verdict = skin_vertices(scene.setup, scene.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(mentions(verdict, "carries no vertex"));
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{1});
}

// --- A surface without owners ----------------------------------------------------------------------------------------

class ClosedSurface : public ::testing::Test {
 protected:
  ClosedSurface() : skin(scene_of({{1, 1, 1}}).state.skin) {
    skin.owner.clear();
    skin.direction.clear();
    skin.reach.clear();
  }
  void expect_rejected_for(const char* text) const {
    const Verdict verdict = closed_surface(skin);
    EXPECT_FALSE(verdict.holds);
    EXPECT_NE(verdict.witness.text.find(text), std::string::npos) << verdict.witness.text;
  }
  Skin skin;  // an octahedron
};

TEST_F(ClosedSurface, HoldsOrIsVacuous) {
  const Verdict verdict = closed_surface(skin);
  EXPECT_TRUE(verdict.holds) << verdict.witness.text;
  EXPECT_EQ(verdict.checked, 8);
  EXPECT_EQ(closed_surface({}).vacuous, "no skin");
}
TEST_F(ClosedSurface, IsRejectedIfATriangleIsMissing) {
  skin.triangles.pop_back();
  expect_rejected_for("open");
}
TEST_F(ClosedSurface, IsRejectedIfATriangleIsFlipped) {
  std::swap(skin.triangles[0][0], skin.triangles[0][1]);
  expect_rejected_for("flipped");
}
TEST_F(ClosedSurface, IsRejectedIfTwoPartsMeetInAVertex) {
  const auto n = static_cast<int32_t>(skin.position.size());
  for (int32_t v = 1; v < n; ++v) skin.position.push_back(skin.position[static_cast<std::size_t>(v)]);
  for (std::size_t k = 0; k < 8; ++k) {
    auto other = skin.triangles[k];
    for (int32_t& v : other) v = v == 0 ? 0 : v + n - 1;
    skin.triangles.push_back(other);
  }
  expect_rejected_for("pinched");
}
TEST_F(ClosedSurface, IsRejectedIfItNamesWhatIsNotThere) {
  for (const int32_t wrong : {-1, 6}) {
    skin.triangles[2][1] = wrong;
    expect_rejected_for("names vertex");
  }
}
TEST_F(ClosedSurface, IsRejectedIfAVertexIsNowhere) {
  skin.position[3].y = kNan;
  expect_rejected_for("vertex 3 is not finite");
}
TEST_F(ClosedSurface, IsRejectedIfATriangleHasACornerTwiceOrAVertexNone) {
  const Skin right = skin;
  skin.triangles[0][0] = skin.triangles[0][1];
  expect_rejected_for("twice");
  skin = right;
  skin.position.push_back({});
  expect_rejected_for("no triangle uses vertex 6");
}

}  // namespace
}  // namespace cutproof::oracles::skin_test
