// A stage that changes what it may not is rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <tuple>

#include "oracles/oracles.h"
#include "tests/oracles/corruptions.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::untouched_test {
namespace {

using namespace cutproof::tests;

struct Change {
  const char* what;
  std::function<void(State&)> change;
  std::vector<Stage> allowed;  // stages that may do this
  Numbers clusters = {}, particles = {};
};

TEST(Untouched, AllowsEachStageItsOwnChangesOnly) {
  const std::vector<Stage> all(kStages.begin(), kStages.end());
  const std::vector<Change> changes = {
      {"nothing", [](State&) {}, all},
      {"a position", [](State& s) { s.x[2].y = 7; }, {Stage::step}, {}, {2}},
      {"a velocity", [](State& s) { s.v[3].y = 7; }, {Stage::step}, {}, {3}},
      {"a velocity's sign of zero", [](State& s) { s.v[3].y = -0.0; }, {Stage::step}, {}, {3}},
      {"the impulse", [](State& s) { s.impulse.x = 1; }, {Stage::step}},
      {"a rotation",
       [](State& s) { s.clusters.rotation[1] = turn_about_z(1); },
       {Stage::step, Stage::split, Stage::merge},
       {1}},
      {"a flag", [](State& s) { s.clusters.degenerate[1] = 1; }, {Stage::step, Stage::split, Stage::merge}, {1}},
      {"alive", [](State& s) { s.alive[4] = 0; }, {Stage::detect, Stage::split}, {}, {4}},
      {"removed", [](State& s) { s.removed = {4}; }, {Stage::detect}},
      {"debris", [](State& s) { s.debris = {4}; }, {Stage::split}},
      {"members", [](State& s) { s.clusters.members[2] = 3; }, {Stage::split, Stage::merge, Stage::expand}},
      {"a rest center",
       [](State& s) { s.clusters.rest_center[0].x = 9; },
       {Stage::split, Stage::merge, Stage::expand},
       {0}},
      {"a cluster's mass", [](State& s) { s.clusters.mass[0] = 9; }, {Stage::split, Stage::merge, Stage::expand}, {0}},
      {"a number", [](State& s) { s.clusters.number[1] = 5; }, {Stage::split, Stage::merge}},
      {"edge_covered", [](State& s) { s.edge_covered = true; }, {Stage::expand}},
      {"tau", [](State& s) { s.tau = 3; }, {}},
      {"cap", [](State& s) { s.cap = 3; }, {}},
      {"a skin position", [](State& s) { s.skin.position[0].x = 9; }, {Stage::skin}},
      {"a skin triangle", [](State& s) { s.skin.triangles.pop_back(); }, {Stage::skin}},
      {"a skin owner", [](State& s) { s.skin.owner[0] = 5; }, {Stage::skin}},
      {"the frame", [](State& s) { ++s.frame; }, {Stage::skin}},
      {"the frame, twice", [](State& s) { s.frame += 2; }, {}},
  };
  for (const auto& [what, change, allowed, clusters, particles] : changes) {
    Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {{0, 1, 2}, {2, 3, 4, 5}});
    pair.before.skin = convex_cell_skin(pair.setup, pair.before);
    pair.after = pair.before;
    change(pair.after);
    for (const Stage stage : kStages) {
      const bool may = std::find(allowed.begin(), allowed.end(), stage) != allowed.end();
      const Verdict verdict = untouched(pair.setup, stage, pair.before, pair.after);
      EXPECT_EQ(verdict.holds, may) << what << " by " << name_of(stage) << ": " << verdict.witness.text;
      if (may) continue;
      EXPECT_FALSE(verdict.witness.text.empty());
      if (!clusters.empty()) {
        EXPECT_EQ(verdict.witness.clusters, clusters) << what;
      }
      if (!particles.empty()) {
        EXPECT_EQ(verdict.witness.particles, particles) << what;
      }
    }
  }
}

TEST(Untouched, RejectsAStepThatMovesTheDeadOrKeepsOldRemovals) {
  Pair pair = pair_of(block_body(3, 1, 1), {{0, 1}}, {{0, 1}});
  remove_particles(pair.before, {2});
  pair.after = pair.before;
  expect_rejected(untouched(pair.setup, Stage::step, pair.before, pair.after), {}, {2});
  pair.after.removed = {};
  expect_holds(untouched(pair.setup, Stage::step, pair.before, pair.after));
  pair.after.x[2].x = 8;
  expect_rejected(untouched(pair.setup, Stage::step, pair.before, pair.after), {}, {2});
}

TEST(Untouched, AsksForCompactNumbersAtTheEndOfAFrame) {
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {});
  pair.before.clusters.number = {1, 4};
  pair.after = pair.before;
  expect_holds(untouched(pair.setup, Stage::skin, pair.before, pair.after));  // the stage alone
  pair.after.frame = 1;
  expect_rejected(untouched(pair.setup, Stage::skin, pair.before, pair.after), {1}, {});
  pair.after.clusters.number = {0, 1};
  expect_holds(untouched(pair.setup, Stage::skin, pair.before, pair.after));
}

// --- Every field, after every stage ----------------------------------------------------------------------------------

class EveryField : public ::testing::TestWithParam<std::tuple<std::size_t, Stage>> {};

TEST_P(EveryField, IsChangedOnlyByItsStages) {
  const auto [index, stage] = GetParam();
  Pair pair = pair_of(block_body(6, 1, 1), {{0, 1, 2}, {2, 3, 4, 5}}, {});
  pair.before.skin = convex_cell_skin(pair.setup, pair.before);
  pair.after = pair.before;
  expect_holds(untouched(pair.setup, stage, pair.before, pair.after));
  std::size_t left = index;
  for_each_field([&](const Field& field, auto get) {
    if (left-- != 0) return;
    alter(field, get(pair.after));
    ASSERT_FALSE(same_bits(get(pair.before), get(pair.after))) << field.name;
    ASSERT_TRUE(well_formed(pair.setup, pair.after).holds) << field.name;
    const Verdict verdict = untouched(pair.setup, stage, pair.before, pair.after);
    const bool named = verdict.witness.text.find(std::string(field.text) + " changed") != std::string::npos;
    if (field.changed_by.contains(stage)) {
      // What may change may still be wrong in another way: a frame counts up by one, a step removes nothing.
      const bool conditional = (stage == Stage::step && field.part == kCut) ||
                               (stage == Stage::skin && (field.part == kTime || field.part == kNumbers));
      EXPECT_EQ(verdict.holds, !conditional) << field.name << ": " << verdict.witness.text;
    } else {
      EXPECT_FALSE(verdict.holds) << field.name;
      EXPECT_TRUE(named) << field.name << ": " << verdict.witness.text;
      EXPECT_EQ(verdict.witness.particles.empty(), field.space != IndexSpace::particle) << field.name;
      EXPECT_EQ(verdict.witness.clusters.empty(), field.space != IndexSpace::cluster) << field.name;
    }
  });
}

std::string name_of_case(const ::testing::TestParamInfo<std::tuple<std::size_t, Stage>>& info) {
  std::string name;
  std::size_t left = std::get<0>(info.param);
  for_each_field([&](const Field& field, auto) {
    if (left-- == 0) name = field.name;
  });
  return name + "_by_" + std::string(name_of(std::get<1>(info.param)));
}

INSTANTIATE_TEST_SUITE_P(Untouched, EveryField,
                         ::testing::Combine(::testing::Range(std::size_t{0}, field_count()),
                                            ::testing::ValuesIn(kStages)),
                         name_of_case);

}  // namespace
}  // namespace cutproof::oracles::untouched_test
