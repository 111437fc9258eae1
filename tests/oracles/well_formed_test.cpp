// What cannot be read safely is rejected.
#include <gtest/gtest.h>

#include <functional>
#include <tuple>
#include <utility>
#include <vector>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::well_formed_test {
namespace {

using namespace cutproof::tests;

TEST(WellFormed, RejectsWhatCannotBeReadSafely) {
  const std::vector<std::pair<const char*, std::function<void(State&)>>> defects = {
      {"positions", [](State& s) { s.x.pop_back(); }},
      {"velocities", [](State& s) { s.v.emplace_back(); }},
      {"alive flags", [](State& s) { s.alive.clear(); }},
      {"neither alive nor dead", [](State& s) { s.alive[3] = 2; }},
      {"offsets are empty", [](State& s) { s.clusters.offsets.clear(); }},
      {"first cluster offset", [](State& s) { s.clusters.offsets[0] = -4; }},
      {"offsets decrease", [](State& s) { s.clusters.offsets[1] = s.clusters.offsets[2] + 1; }},
      {"last cluster offset", [](State& s) { s.clusters.offsets.back() += 1; }},
      {"numbers do not ascend", [](State& s) { std::swap(s.clusters.number[0], s.clusters.number[1]); }},
      {"numbers do not ascend", [](State& s) { s.clusters.number[0] = -1; }},
      {"rotations", [](State& s) { s.clusters.rotation.pop_back(); }},
      {"rest centers", [](State& s) { s.clusters.rest_center.pop_back(); }},
      {"masses", [](State& s) { s.clusters.mass.pop_back(); }},
      {"flags", [](State& s) { s.clusters.degenerate.pop_back(); }},
      {"particle -1", [](State& s) { s.clusters.members[0] = -1; }},
      {"particle 48", [](State& s) { s.clusters.members[0] = 48; }},
      {"removed lists", [](State& s) { s.removed = {48}; }},
      {"debris does not ascend",
       [](State& s) {
         s.debris = {4, 4};
       }},
      {"directions", [](State& s) { s.skin.direction.pop_back(); }},
      {"reaches", [](State& s) { s.skin.reach.pop_back(); }},
      {"not on its edge", [](State& s) { s.skin.reach[0] = 0; }},
      {"not on its edge", [](State& s) { s.skin.reach[0] = 1; }},
      {"not on its edge", [](State& s) { s.skin.reach[0] = std::nan(""); }},
      {"has owner", [](State& s) { s.skin.owner[0] = -1; }},
      {"has owner", [](State& s) { s.skin.direction[0] = 6; }},
      {"names vertex", [](State& s) { s.skin.triangles[0][1] = -1; }},
      {"frame", [](State& s) { s.frame = -1; }},
  };
  for (const auto& [said, breaks] : defects) {
    Block block;
    breaks(block.state);
    const Verdict verdict = well_formed(block.setup, block.state);
    EXPECT_FALSE(verdict.holds) << said;
    EXPECT_NE(verdict.witness.text.find(said), std::string::npos) << verdict.witness.text;
  }
}

TEST(WellFormed, NamesTheParticleThatDoesNotExist) {
  Block block;
  block.state.clusters.members[0] = 48;
  expect_rejected(well_formed(block.setup, block.state), {}, {48});
}

TEST(WellFormed, RejectsABodyWhoseTablesDisagree) {
  Block block;
  block.setup.body.particle_at[static_cast<std::size_t>(block.setup.body.node[7])] = 8;
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
  block = Block();
  block.setup.body.mass.pop_back();
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
  block = Block();
  block.setup.body.node[0] = 0;  // on the ring
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
  // Of the block's first particle: +x leads to the next one, -x leaves it.
  const std::size_t n = block.setup.body.node.size();
  for (const auto& [entry, crossing, right] :
       {std::tuple(1, 128, true), {1, 16, true}, {1, 240, true}, {1, 15, false}, {1, 241, false}, {0, 128, false}}) {
    block = Block();
    block.setup.body.surface_crossing.assign(6 * n, 0);
    block.setup.body.surface_crossing[static_cast<std::size_t>(entry)] = static_cast<uint8_t>(crossing);
    EXPECT_EQ(well_formed(block.setup, block.state).holds, right) << entry << " " << crossing;
  }
  block.setup.body.surface_crossing.assign(6 * n - 1, 0);
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
  block = Block();
  block.setup.has_blade = true;  // without moves
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
  block = Block();
  block.setup.grips.push_back({{0}, {1}, {}});
  EXPECT_FALSE(well_formed(block.setup, block.state).holds);
}

}  // namespace
}  // namespace cutproof::oracles::well_formed_test
