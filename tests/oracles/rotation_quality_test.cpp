// Rotations that are none are rejected.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles {
namespace {

using namespace cutproof::testing;

TEST(RotationQuality, RejectsAReflectionAndNamesItsCluster) {
  const auto setup = setup_of(block_body(4, 4, 4));
  State state = state_of(setup.body, box_clusters(4, 4, 4, 2));
  EXPECT_TRUE(rotation_quality(setup, state).holds);
  EXPECT_EQ(rotation_quality(setup, state).checked, 8);
  state.clusters.number[5] = 5;
  state.clusters.rotation[5] = {{1, 0, 0, 0, 1, 0, 0, 0, -1}};
  const Verdict verdict = rotation_quality(setup, state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{5});
  EXPECT_NE(verdict.witness.text.find("reflection"), std::string::npos);
}

TEST(RotationQuality, RejectsWhatIsNotOrthogonal) {
  const auto setup = setup_of(block_body(4, 4, 4));
  for (const double wrong : {1e-4, -0.5, std::numeric_limits<double>::quiet_NaN()}) {
    State state = state_of(setup.body, box_clusters(4, 4, 4, 2));
    state.clusters.rotation[2](0, 1) += wrong;
    const Verdict verdict = rotation_quality(setup, state);
    EXPECT_FALSE(verdict.holds) << wrong;
    EXPECT_EQ(verdict.witness.clusters, std::vector<int32_t>{2});
  }
}

}  // namespace
}  // namespace cutproof::oracles
