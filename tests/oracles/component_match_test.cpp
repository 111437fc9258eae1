// I3 and the skin: tissue and coupling fall into the same components, and so do tissue and shells.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "oracles/oracles.h"
#include "oracles/shells.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::component_match_test {
namespace {

using namespace cutproof::tests;

TEST(ComponentMatch, RejectsConnectedTissueThatIsNotCoupledWithThePathBetween) {
  Row row(6, {{0, 1, 2}, {3, 4}, {4, 5}});
  const Verdict verdict = component_match(row.setup, row.state);
  expect_rejected(verdict, {}, {2, 3});
  EXPECT_EQ(verdict.witness.path, Numbers({2, 3}));
  EXPECT_EQ(verdict.measured, 1);
}

TEST(ComponentMatch, RejectsACouplingAcrossAGapAndNamesTheCluster) {
  Row row(5, {{0, 1}, {1, 3}, {3, 4}});
  remove_particles(row.state, {2});
  const Verdict verdict = component_match(row.setup, row.state);
  expect_rejected(verdict, {1}, {1, 3});
  EXPECT_TRUE(verdict.witness.path.empty());
}

TEST(ComponentMatch, RejectsACouplingThatCrossesWhileCountsAgree) {
  // Two components of tissue and two of coupling, but not the same ones.
  Row row(7, {{0, 1}, {1, 4}, {2}, {5, 6}, {4, 5}});
  remove_particles(row.state, {3});
  ASSERT_EQ(graph_components(row.setup, row.state).count, coupling_components(row.setup, row.state).count);
  const Verdict verdict = component_match(row.setup, row.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.measured, 2);  // one group too many in {0, 1, 2}, one coupling too far
  EXPECT_EQ(verdict.witness.clusters, Numbers{1}) << "of the two the coupling is shown, which nobody may expect";
}

// Two blocks of 2 × 2 × 2 with a gap of one node between them, in one cluster each.
struct TwoBlocks {
  TwoBlocks() {
    for (int32_t k = 0; k < 2; ++k) {
      for (int32_t j = 0; j < 2; ++j) {
        for (const int32_t i : {0, 1, 3, 4}) nodes.push_back({i, j, k});
      }
    }
    setup = setup_of(body_of(nodes));
    state = state_of(setup.body, {{0, 1, 4, 5, 8, 9, 12, 13}, {2, 3, 6, 7, 10, 11, 14, 15}});
    state.skin = convex_cell_skin(setup, state);
  }
  std::vector<Node> nodes;
  Setup setup;
  State state;
};

TEST(SkinMatch, AcceptsTwoPiecesWithTwoShells) {
  const TwoBlocks two;
  ASSERT_EQ(graph_components(two.setup, two.state).count, 2);
  expect_holds(skin_match(two.setup, two.state));
}

TEST(ComponentMatch, TellsTheSizesOfThePieces) {
  TwoBlocks two;
  two.state.clusters = clusters_of(two.setup.body, {{0, 1, 4, 5, 8, 9, 12, 13}, {2, 3, 6, 7, 10, 11}, {14}, {15}});
  const Verdict uncoupled = component_match(two.setup, two.state);
  EXPECT_FALSE(uncoupled.holds);
  EXPECT_NE(uncoupled.witness.text.find(
                "the tissue is 2 pieces (of 8 and 8 particles), and what clusters couple is 4 pieces (of 8, 6, "
                "1 and 1 particles)"),
            std::string::npos)
      << uncoupled.witness.text;
}

TEST(SkinMatch, RejectsAPieceWithoutAShell) {
  TwoBlocks two;
  auto& triangles = two.state.skin.triangles;
  std::erase_if(triangles,
                [&](const auto& t) { return two.state.skin.owner[static_cast<std::size_t>(t[0])] % 4 >= 2; });
  const Verdict verdict = skin_match(two.setup, two.state);
  expect_rejected(verdict, {}, {2});
  EXPECT_NE(verdict.witness.text.find("; the tissue is 2 pieces (of 8 and 8 particles), and the skin has 1 shells"),
            std::string::npos)
      << verdict.witness.text;
}

TEST(SkinMatch, RejectsAShellThatJoinsTwoPieces) {
  TwoBlocks two;
  // Weld a vertex of one shell to a vertex of the other.
  auto& skin = two.state.skin;
  const auto vertex_of = [&](bool right) {
    for (std::size_t v = 0; v < skin.owner.size(); ++v) {
      if ((skin.owner[v] % 4 >= 2) == right) return static_cast<int32_t>(v);
    }
    return -1;
  };
  const int32_t left = vertex_of(false), right = vertex_of(true);
  for (auto& t : skin.triangles) std::replace(t.begin(), t.end(), right, left);
  const Verdict verdict = skin_match(two.setup, two.state);
  EXPECT_FALSE(verdict.holds);
  ASSERT_EQ(verdict.witness.particles.size(), 2u) << verdict.witness.text;
  EXPECT_NE(verdict.witness.particles[0] % 4 >= 2, verdict.witness.particles[1] % 4 >= 2);
}

TEST(SkinMatch, RejectsOldSkinAroundAParticleThatDied) {
  Block block;
  block.state.alive[0] = 0;
  block.state.clusters = clusters_of(block.setup.body, {range(1, 48)});
  expect_rejected(skin_match(block.setup, block.state), {}, {0});
}

TEST(SkinMatch, RejectsOneShellAroundTissueThatFellApart) {
  Row row(5, {{0, 1}, {3, 4}});
  row.state.skin = convex_cell_skin(row.setup, row.state);
  row.state.alive[2] = 0;
  auto& skin = row.state.skin;  // as if the new skin had closed over the gap
  for (auto& owner : skin.owner) owner = owner == 2 ? 3 : owner;
  expect_rejected(skin_match(row.setup, row.state), {}, {0, 3});
}

TEST(SkinMatch, RejectsAMissingSkinAfterTheFirstFrame) {
  Block block;
  block.state.skin = {};
  expect_holds(skin_match(block.setup, block.state));  // as cooked
  block.state.frame = 1;
  expect_rejected(skin_match(block.setup, block.state), {}, {0});
  block.setup.skin.wanted = false;
  expect_holds(skin_match(block.setup, block.state));
}

// 5 × 5 × 5 around a cavity of one node in the middle.
struct Hollow {
  Hollow() : setup(setup_of(block_body(5, 5, 5))), state(state_of(setup.body, {range(0, 125)})) {
    remove_particles(state, {62});
    std::vector<int32_t> rest = range(0, 125);
    rest.erase(rest.begin() + 62);
    state.clusters = clusters_of(setup.body, {rest});
    state.skin = convex_cell_skin(setup, state);
  }
  Setup setup;
  State state;
};

TEST(SkinMatch, CountsACavityAsAnInnerShell) {
  const Hollow hollow;
  expect_holds(skin_match(hollow.setup, hollow.state));
  const ShellCount shells = count_shells(hollow.state.skin);
  EXPECT_EQ(shells.outer, 1);
  EXPECT_EQ(shells.inner, 1);
}

// With as many cavities as components the shells would only change their roles.
TEST(SkinMatch, RejectsASkinThatIsInsideOut) {
  Hollow hollow;
  Block solid(5, 5, 5);
  for (State* const state : {&hollow.state, &solid.state}) {
    for (auto& triangle : state->skin.triangles) std::swap(triangle[0], triangle[1]);
    const Verdict verdict = skin_match(state == &solid.state ? solid.setup : hollow.setup, *state);
    EXPECT_FALSE(verdict.holds);
    EXPECT_NE(verdict.witness.text.find("is inside out"), std::string::npos) << verdict.witness.text;
  }
}

TEST(SkinMatch, RejectsACavityWithoutItsInnerShell) {
  Hollow hollow;
  Block solid(5, 5, 5);
  hollow.state.skin = solid.state.skin;
  const Verdict verdict = skin_match(hollow.setup, hollow.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("0 inner shells"), std::string::npos) << verdict.witness.text;
}

TEST(SkinMatch, TakesTwoCavitiesThatTouchAtAnEdgeForOneAndAtACornerForTwo) {
  // The skin separates inside corners on ambiguous faces, so empty nodes with 18 neighbours are one cavity. Without a
  // skin of such cells at hand the number of cavities shows in the complaint about the skin of the solid block.
  const auto complaint = [](const Node& second) {
    Block block(6, 6, 6);
    const auto particle = [](const Node& c) { return c[0] + 6 * (c[1] + 6 * c[2]); };
    remove_particles(block.state, {particle({2, 2, 2}), particle(second)});
    block.state.clusters = clusters_of(block.setup.body, {[&] {
                                         std::vector<int32_t> rest;
                                         for (int32_t i = 0; i < 216; ++i) {
                                           if (block.state.alive[static_cast<std::size_t>(i)] != 0) rest.push_back(i);
                                         }
                                         return rest;
                                       }()});
    return skin_match(block.setup, block.state).witness.text;
  };
  EXPECT_NE(complaint({3, 2, 2}).find("1 cavities"), std::string::npos);
  EXPECT_NE(complaint({3, 3, 2}).find("1 cavities"), std::string::npos);
  EXPECT_NE(complaint({3, 3, 3}).find("2 cavities"), std::string::npos);
  EXPECT_NE(complaint({4, 2, 2}).find("2 cavities"), std::string::npos);
}

TEST(SkinMatch, AcceptsAPieceInsideTheCavityOfAnother) {
  Block block(7, 7, 7);
  const auto particle = [](int32_t i, int32_t j, int32_t k) { return i + 7 * (j + 7 * k); };
  std::vector<int32_t> shell, removed;
  for (int32_t k = 0; k < 7; ++k) {
    for (int32_t j = 0; j < 7; ++j) {
      for (int32_t i = 0; i < 7; ++i) {
        const int32_t reach = std::max({std::abs(i - 3), std::abs(j - 3), std::abs(k - 3)});
        if (reach == 1) removed.push_back(particle(i, j, k));
        if (reach >= 2) shell.push_back(particle(i, j, k));
      }
    }
  }
  remove_particles(block.state, removed);
  block.state.clusters = clusters_of(block.setup.body, {shell, {particle(3, 3, 3)}});
  block.state.skin = convex_cell_skin(block.setup, block.state);
  expect_holds(skin_match(block.setup, block.state));
}

TEST(SkinMatch, AcceptsASkinThatMotionTurnedInsideOut) {
  Hollow hollow;
  for (Vec3& p : hollow.state.skin.position) p.x = -p.x;
  expect_holds(skin_match(hollow.setup, hollow.state));
}

}  // namespace
}  // namespace cutproof::oracles::component_match_test
