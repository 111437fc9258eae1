// The list of properties. Linked without CGAL and SuiteSparse: verdicts need neither.
#include "oracles/registry.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string_view>

#include "oracles/judged.h"
#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles {
namespace {

using namespace cutproof::tests;

TEST(Registry, SaysOfEachPropertyAllThatAJudgeMustKnow) {
  std::set<std::string_view> names;
  for (const Property& property : core_properties()) {
    SCOPED_TRACE(property.name);
    EXPECT_TRUE(names.insert(property.name).second) << "named twice";
    EXPECT_FALSE(property.source.empty());
    EXPECT_FALSE(property.unit.empty());
    EXPECT_FALSE(property.nothing.empty());
    EXPECT_NE(property.rests_on & kAll, 0u);
    EXPECT_NE(property.check_state == nullptr, property.check_stage == nullptr) << "of a state or of a stage";
    EXPECT_EQ(property.check_state == nullptr, property.due.holds == nullptr);
    EXPECT_EQ(property.check_state == nullptr, property.due.text.empty());
    if (property.check_stage != nullptr) {
      EXPECT_NE(property.promised_by.bits, 0u) << "no stage asks for it";
    }
  }
  EXPECT_EQ(core_properties().front().name, "well formed");
  EXPECT_THROW(property_named(core_properties(), "beauty"), std::out_of_range);
}

TEST(Registry, EachVerdictBearsTheNameUnitAndSourceOfItsRow) {
  const Block block;
  for (const Property& property : core_properties()) {
    const Verdict verdict = property.check_state != nullptr
                                ? ask(property, block.setup, block.state)
                                : ask(property, block.setup, Stage::skin, block.state, block.state);
    EXPECT_EQ(verdict.property, property.name);
    EXPECT_EQ(verdict.unit, property.unit);
    EXPECT_EQ(verdict.bound_source, property.source);
  }
}

TEST(Registry, AVerdictThatCheckedNothingSaysWhy) {
  const auto setup = setup_of(body_of({}));
  State state = state_of(setup.body, {});
  state.edge_covered = true;  // there is no edge
  for (const Property& property : core_properties()) {
    const Verdict verdict = property.check_state != nullptr ? ask(property, setup, state)
                                                            : ask(property, setup, Stage::merge, state, state);
    EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
    EXPECT_EQ(verdict.checked == 0, !verdict.vacuous.empty()) << verdict.property;
  }
  Row row(5, {{0, 1, 2}, {3, 4}});
  EXPECT_EQ(edge_cover(row.setup, row.state).vacuous, "the state does not promise it");
  EXPECT_EQ(no_pass(row.setup, row.state).vacuous, "no blade");
  EXPECT_EQ(merge_maximality(row.setup, row.state).vacuous, "no cluster is small");
  row.setup.merge.rule = MergeRule::none;
  EXPECT_EQ(merge_maximality(row.setup, row.state).vacuous, "the rule does not promise it");
  row.state.frame = 1;
  EXPECT_EQ(momentum(row.setup, row.state, row.state).vacuous, "the schedule is over");
}

TEST(Registry, TheCoreJudgesAFrameByItself) {
  const Block block;
  Judge judge(block.setup, {&core_properties()});
  const auto verdicts = judge.state(block.state, Stage::skin, true);
  EXPECT_GE(verdicts.size(), 11u);
  for (const Verdict& verdict : verdicts) expect_holds(verdict);
  State broken = block.state;
  broken.x[7].y = kNan;
  int rejected = 0;
  for (const Verdict& verdict : judge.state(broken, Stage::skin, true)) rejected += verdict.holds ? 0 : 1;
  EXPECT_GT(rejected, 0);
}

// A property of one's own beside those that are there.
TEST(Registry, TakesAPropertyOfAGuest) {
  const PropertyList own = {{"nothing moves", "the guest", "m/s", kMotion, Cost::cheap, stages(), "always",
                             [](const cutproof::Setup&, const State&, Stage) { return true; }, "no particles",
                             [](Judged& judged, Verdict& verdict) {
                               for (std::size_t i = 0; i < judged.state.v.size(); ++i) {
                                 ++verdict.checked;
                                 if (norm(judged.state.v[i]) == 0) continue;
                                 violate(verdict, {{}, {static_cast<int32_t>(i)}}, "it moves");
                               }
                             },
                             nullptr}};
  Block block;
  const auto moving = [&](const State& state) {
    for (const Verdict& verdict : judge(block.setup, state, false, {&core_properties(), &own})) {
      if (verdict.property == "nothing moves") return verdict;
    }
    return Verdict{};
  };
  expect_holds(moving(block.state));
  block.state.v[5].z = 1;
  expect_rejected(moving(block.state), {}, {5});
}

}  // namespace
}  // namespace cutproof::oracles
