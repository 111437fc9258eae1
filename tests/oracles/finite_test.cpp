// NaN and infinity are found wherever they are.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "oracles/oracles.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::finite_test {
namespace {

using namespace cutproof::tests;

TEST(Finite, RejectsEveryKindOfNumberAndNamesWhereItIs) {
  const auto rejected = [](const std::function<void(State&)>& breaks, const Numbers& clusters,
                           const Numbers& particles) {
    Block block;
    breaks(block.state);
    expect_rejected(finite(block.setup, block.state), clusters, particles);
  };
  rejected([](State& s) { s.x[7].z = kNan; }, {}, {7});
  rejected([](State& s) { s.v[8].x = std::numeric_limits<double>::infinity(); }, {}, {8});
  rejected([](State& s) { s.clusters.rotation[1].m[4] = kNan; }, {1}, {});
  rejected([](State& s) { s.clusters.rest_center[2].x = kNan; }, {2}, {});
  rejected([](State& s) { s.clusters.mass[3] = kNan; }, {3}, {});
  rejected([](State& s) { s.impulse.y = kNan; }, {}, {});
  rejected([](State& s) { s.skin.position[0].y = kNan; }, {}, {0});
}

}  // namespace
}  // namespace cutproof::oracles::finite_test
