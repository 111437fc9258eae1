// What the tests of the skin share: bodies by their nodes, in one cluster, with the skin at rest.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "oracles/oracles.h"
#include "oracles/surface/surface.h"
#include "tests/oracles/states.h"

namespace cutproof::tests {

// One cluster over all particles, and the skin at rest.
inline Scene scene_of(const std::vector<Node>& nodes, double spacing = 1.0) {
  Scene scene{setup_of(body_of(nodes, spacing)), {}};
  scene.state = state_of(scene.setup.body, {range(0, scene.setup.body.particle_count())});
  scene.state.skin = convex_cell_skin(scene.setup, scene.state);
  return scene;
}

inline std::vector<Node> block_nodes(Node low, Node high) {
  std::vector<Node> nodes;
  for (int32_t k = low[2]; k < high[2]; ++k) {
    for (int32_t j = low[1]; j < high[1]; ++j) {
      for (int32_t i = low[0]; i < high[0]; ++i) nodes.push_back({i, j, k});
    }
  }
  return nodes;
}

inline std::vector<Node> without(std::vector<Node> nodes, const std::vector<Node>& holes) {
  std::erase_if(nodes, [&](const Node& n) { return std::find(holes.begin(), holes.end(), n) != holes.end(); });
  return nodes;
}

inline bool mentions(const Verdict& verdict, const std::string& text) {
  return verdict.witness.text.find(text) != std::string::npos;
}

inline bool names_particle(const Verdict& verdict, int32_t particle) {
  const auto& list = verdict.witness.particles;
  return std::find(list.begin(), list.end(), particle) != list.end();
}

inline void expect_all_hold(const Scene& scene) {
  for (const auto oracle : {oracles::skin_surface, oracles::skin_geometry, oracles::skin_vertices}) {
    const Verdict verdict = oracle(scene.setup, scene.state);
    EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
    EXPECT_GT(verdict.checked, 0) << verdict.property;
    EXPECT_TRUE(verdict.witness.text.empty());
  }
}

inline int32_t vertex_of(const Skin& skin, int32_t owner, int direction) {
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    if (skin.owner[v] == owner && skin.direction[v] == direction) return static_cast<int32_t>(v);
  }
  return -1;
}

}  // namespace cutproof::tests
