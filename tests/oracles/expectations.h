// What the tests of the oracles share: what is expected of a verdict, and scenes made by hand.
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "model/verdict.h"
#include "tests/oracles/states.h"

namespace cutproof::tests {

using Numbers = std::vector<int32_t>;

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline void expect_holds(const Verdict& verdict) {
  EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  EXPECT_EQ(verdict.witness, Witness{});
  EXPECT_LE(verdict.measured, verdict.bound);
  EXPECT_FALSE(verdict.property.empty());
  EXPECT_FALSE(verdict.unit.empty());
  EXPECT_FALSE(verdict.bound_source.empty());
  EXPECT_EQ(verdict.checked == 0, !verdict.vacuous.empty()) << verdict.property << ": " << verdict.vacuous;
}

inline void expect_rejected(const Verdict& verdict, const Numbers& clusters, const Numbers& particles) {
  EXPECT_FALSE(verdict.holds) << verdict.property;
  EXPECT_GT(verdict.measured, verdict.bound);
  EXPECT_EQ(verdict.witness.clusters, clusters) << verdict.witness.text;
  EXPECT_EQ(verdict.witness.particles, particles) << verdict.witness.text;
  EXPECT_FALSE(verdict.witness.text.empty());
}

// A solid block in overlapping boxes, edge covered.
struct Block {
  explicit Block(int32_t nx = 4, int32_t ny = 4, int32_t nz = 3)
      : setup(setup_of(block_body(nx, ny, nz, 0.5))), state(state_of(setup.body, box_clusters(nx, ny, nz, 2))) {
    state.edge_covered = true;
    state.skin = convex_cell_skin(setup, state);
  }
  Setup setup;
  State state;
};

// Particles 0 .. n - 1 in a row along x.
struct Row {
  explicit Row(int32_t n, const Lists& lists)
      : setup(setup_of(block_body(n, 1, 1))), state(state_of(setup.body, lists)) {}
  Setup setup;
  State state;
};

// A state before and after a stage.
struct Pair {
  Setup setup;
  State before, after;
};

inline Pair pair_of(Body body, const Lists& before, const Lists& after) {
  Pair pair;
  pair.setup = setup_of(std::move(body));
  pair.before = state_of(pair.setup.body, before);
  pair.after = state_of(pair.setup.body, after);
  return pair;
}

inline void set_clusters(const Setup& setup, State& state, const Lists& lists, const Numbers& numbers) {
  state.clusters = clusters_of(setup.body, lists);
  state.clusters.number = numbers;
}

inline Mat3 turn_about_z(double angle) {
  return {{std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1}};
}

// A row of nine, cut at 4. Cluster 0 lies left of the cut, 2 across it, 5 right of it and across it, 6 right.
inline Pair cut_row() {
  Pair pair = pair_of(block_body(9, 1, 1), {}, {});
  set_clusters(pair.setup, pair.before, {{0, 1, 2}, {1, 2, 3, 4, 5}, {3, 4, 5, 6, 7}, {7, 8}}, {0, 2, 5, 6});
  for (std::size_t c = 0; c < 4; ++c) pair.before.clusters.rotation[c] = turn_about_z(static_cast<double>(c));
  remove_particles(pair.before, {4});
  pair.after = pair.before;
  // 2 keeps {1, 2, 3}, 5 keeps {3}; {5} of 2 becomes 7, {5, 6, 7} of 5 becomes 8.
  set_clusters(pair.setup, pair.after, {{0, 1, 2}, {1, 2, 3}, {3}, {7, 8}, {5}, {5, 6, 7}}, {0, 2, 5, 6, 7, 8});
  const std::array<int, 6> parent = {0, 1, 2, 3, 1, 2};
  for (std::size_t c = 0; c < 6; ++c) pair.after.clusters.rotation[c] = turn_about_z(parent[c]);
  return pair;
}

}  // namespace cutproof::tests
