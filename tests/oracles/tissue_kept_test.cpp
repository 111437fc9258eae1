// What died and was not taken out is named.
#include <gtest/gtest.h>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::tissue_kept_test {
namespace {

using namespace cutproof::tests;

constexpr StateOracle tissue_kept{lone_state_properties, "tissue kept"};

TEST(TissueKept, RejectsADeadParticleThatNobodyTookOut) {
  Row row(4, {{0, 1}, {1, 2}});
  row.state.alive[3] = 0;
  expect_rejected(tissue_kept(row.setup, row.state), {}, {3});
  row.state.removed = {1};
  expect_rejected(tissue_kept(row.setup, row.state), {}, {3});
}

TEST(TissueKept, AcceptsWhatWasRemovedAndDebris) {
  Row row(4, {{0, 1}});
  row.state.alive[2] = row.state.alive[3] = 0;
  row.state.removed = {3};
  row.state.debris = {2};
  const Verdict verdict = tissue_kept(row.setup, row.state);
  expect_holds(verdict);
  EXPECT_EQ(verdict.checked, 2);
}

TEST(TissueKept, IsVacuousWhereNothingIsDead) {
  Row row(2, {{0, 1}});
  const Verdict verdict = tissue_kept(row.setup, row.state);
  EXPECT_TRUE(verdict.holds);
  EXPECT_EQ(verdict.checked, 0);
  EXPECT_EQ(verdict.vacuous, "nothing is dead");
}

// It is nobody's to ask of a run, whose states name the particles of their frame alone.
TEST(TissueKept, IsNoPropertyOfRuns) {
  for (const PropertyList* const list : {&core_properties(), &motion_properties()}) {
    EXPECT_THROW(property_named(*list, "tissue kept"), std::out_of_range);
  }
}

}  // namespace
}  // namespace cutproof::oracles::tissue_kept_test
