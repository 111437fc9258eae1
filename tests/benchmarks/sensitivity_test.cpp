// `cutproof bench sensitivity`: that a disturbance is one, that the least one is found where a bound is known, and what
// each row must show.
#include "benchmarks/sensitivity.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "benchmarks/suites/suites.h"
#include "fixtures/build.h"
#include "model/io/scene_io.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#include "tests/program.h"

namespace cutproof::benchmarks::sensitivity_test {
namespace {

using nlohmann::json;

// Cut in two as it falls; friction where it lands.
constexpr const char* kFallingApart = R"({"version": 5, "name": "falling apart",
  "body": {"shape": {"kind": "box", "size": [0.06, 0.02, 0.02]}, "spacing": 0.01},
  "frame": {"settle": 0.08}, "detect": {"criterion": "geometric"},
  "step": {"acceleration": "none", "gravity": [0, 0, -9.81]},
  "ground": {"friction": 0.5},
  "blade": {"speed": 2, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

ReadyScene make_scene(const std::string& text) {
  fixtures::Built built = fixtures::build(io::parse_scene(text, "the test's scene"), "the test's scene");
  return {"falling", std::move(built.setup), std::move(built.state)};
}

const Disturbance& disturbance_named(const std::string& name) {
  for (const Disturbance& one : disturbances()) {
    if (one.name == name) return one;
  }
  throw std::logic_error("there is no such disturbance");
}

struct Kept {
  std::unique_ptr<Backend> backend = reference::make_backend();
  ReadyScene scene = make_scene(kFallingApart);
  KeptRun run = keep_run(*backend, scene);

  Sensitivity least(const Disturbance& disturbance, Stage stage, int64_t count = 4) {
    return least_rejected(*backend, scene.setup, disturbance, stage, moments_of(scene.setup, run.trace, stage, count));
  }
};

// Held against the property itself, asked alone, on either side of what was found.
TEST(LeastRejected, IsWhereThePropertyBeginsToFail) {
  Kept kept;
  const Disturbance& vertex = disturbance_named("skin vertex");
  const auto moments = moments_of(kept.scene.setup, kept.run.trace, Stage::skin, 1);
  ASSERT_EQ(moments.size(), 1u);
  const Sensitivity found = kept.least(vertex, Stage::skin, 1);
  ASSERT_TRUE(found.least.has_value());
  EXPECT_EQ(found.property, "skin vertices");
  const auto holds = [&](double size) {
    State state = *moments[0].after;
    vertex.of_state(kept.scene.setup, state, size);
    return oracles::skin_vertices(kept.scene.setup, state).holds;
  };
  EXPECT_FALSE(holds(*found.least));
  EXPECT_TRUE(holds(*found.least / 1.06));
}

TEST(LeastRejected, IsTheLeastThatIsTriedWhereAStageMayChangeNothing) {
  Kept kept;
  for (const char* name : {"mass", "rotation", "impulse", "rest center"}) {
    const Sensitivity found = kept.least(disturbance_named(name), Stage::skin);
    ASSERT_TRUE(found.least.has_value()) << name;
    EXPECT_LT(*found.least, 1e-14) << name;
    EXPECT_EQ(found.property, "untouched") << name;
  }
}

TEST(LeastRejected, IsAbsentWhereNothingIsAndCountsWhatThereWasToChange) {
  Kept kept;
  Disturbance nothing;
  nothing.of_state = [](const cutproof::Setup&, State&, double) {};
  EXPECT_EQ(kept.least(nothing, Stage::step).moments, 0);
  EXPECT_FALSE(kept.least(nothing, Stage::step).least.has_value());
  Disturbance harmless;
  harmless.of_run = [](cutproof::Setup&, State&, double) { return true; };
  EXPECT_EQ(kept.least(harmless, Stage::step).moments, 4);
  EXPECT_FALSE(kept.least(harmless, Stage::step).least.has_value());
}

// Without a run of its own the disturbed state would be the undisturbed one, and hold.
TEST(LeastRejected, OfTheRunIsWhatTheBackendMakesOfIt) {
  Kept kept;
  const Sensitivity gravity = kept.least(disturbance_named("gravity"), Stage::step);
  ASSERT_TRUE(gravity.least.has_value());
  EXPECT_LT(*gravity.least, 1e-6);
  EXPECT_FALSE(gravity.rounding.has_value());
}

TEST(LeastRejected, OfAForceNeedsTwoPieces) {
  Kept kept;
  const auto all = kept.least(disturbance_named("impulse between pieces"), Stage::step, 1000).moments;
  EXPECT_GT(all, 0);
  EXPECT_LT(all, static_cast<int64_t>(moments_of(kept.scene.setup, kept.run.trace, Stage::step, 1000).size()));
}

TEST(LeastRejected, AsksInEachMomentWhetherItIsToStop) {
  Kept kept;
  const auto moments = moments_of(kept.scene.setup, kept.run.trace, Stage::step, 4);
  ASSERT_EQ(moments.size(), 4u);
  for (const int most : {0, 3, 6}) {  // while it looks what there is to change, measures rounding, and tries
    int asked = 0;
    EXPECT_THROW(least_rejected(*kept.backend, kept.scene.setup, disturbance_named("position"), Stage::step, moments,
                                [&] { return ++asked > most; }),
                 Stopped);
    EXPECT_EQ(asked, most + 1);
  }
  int asked = 0;
  EXPECT_THROW(keep_run(*kept.backend, kept.scene, [&] { return ++asked > 5; }), Stopped);
}

TEST(KeptRun, HoldsAndIsSummedUp) {
  Kept kept;
  EXPECT_TRUE(kept.run.failed.empty());
  ASSERT_NE(kept.run.properties.find("linear momentum", Stage::step), nullptr);
  EXPECT_GT(kept.run.properties.find("linear momentum", Stage::step)->checked, 0);
  const auto moments = moments_of(kept.scene.setup, kept.run.trace, Stage::step, 3);
  ASSERT_EQ(moments.size(), 3u);
  EXPECT_LT(moments[0].before->frame, moments[1].before->frame);
  EXPECT_LT(moments[1].before->frame, moments[2].before->frame);
}

class BenchSensitivity : public Program {};

TEST_F(BenchSensitivity, HasARowForEachDisturbanceAndStage) {
  for (const std::string backend : {"reference", "host"}) {
    const Outcome outcome =
        cutproof("bench sensitivity --particles 300 --moments 2 --json out.json --backend " + backend);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("suite"), "sensitivity");
    EXPECT_TRUE(document.at("complete"));
    EXPECT_TRUE(document.at("holds"));
    ASSERT_EQ(document.at("scenes").size(), 3u);
    std::set<std::string> seen;
    for (const json& row : document.at("rows")) {
      seen.insert(row.at("disturbance"));
      EXPECT_GT(row.at("moments"), 0);
      if (row.at("least").is_null()) continue;
      EXPECT_GE(row.at("least"), document.at("least_tried"));
      EXPECT_LE(row.at("least"), row.at("greatest_tried"));
      EXPECT_FALSE(row.at("property").is_null());
      // Where it slides, friction is no more than a bound in single precision away.
      if (row.at("disturbance") == "friction" && row.at("scene") == "small_block, sliding") {
        EXPECT_LT(row.at("least"), 0.01);
      }
      if (!row.at("ratio").is_null()) {
        EXPECT_DOUBLE_EQ(row.at("ratio"), row.at("least").get<double>() / row.at("rounding").get<double>());
      }
      if (!row.at("goal").is_null()) {
        EXPECT_EQ(row.at("within_goal"), row.at("least") <= row.at("goal"));
      }
    }
    for (const Disturbance& disturbance : disturbances()) {
      EXPECT_TRUE(seen.contains(disturbance.name)) << disturbance.name << " on " << backend;
      EXPECT_NE(outcome.output.find(disturbance.name), std::string::npos);
    }
  }
}

TEST_F(BenchSensitivity, RefusesBadUsage) {
  expect_refused("bench sensitivity --backend nobody", {"nobody"});
  expect_refused("bench sensitivity --backend 'plugin:" CUTPROOF_PLUGIN_OF_WHOLE_FRAMES "'", {"--backend", "step"});
  expect_refused("bench sensitivity --particles 10", {"particles"});
  expect_refused("bench sensitivity --moments 0", {"moments"});
}

}  // namespace
}  // namespace cutproof::benchmarks::sensitivity_test
