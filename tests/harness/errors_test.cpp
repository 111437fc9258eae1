// `cutproof run --errors`, on a scene whose geometry is known by hand.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/program.h"

namespace errors_test {
namespace {

using nlohmann::json;

// 6 × 5 × 5 particles, which rest at 0.5, 1.5, … h of the box. The blade goes down at 2.7 h of 6: it takes the layer at
// 2.5 h.
constexpr const char* kScene = R"({"version": 5, "name": "small",
  "body": {"shape": {"kind": "box", "size": [0.06, 0.05, 0.05]}, "spacing": 0.01, "fit_skin": false},
  "skin": {"fit_cuts": false},
  "frame": {"settle": 0.032}, "step": {"acceleration": "none"}, "detect": {"criterion": "geometric"},
  "blade": {"speed": 1, "strokes": [{"points": [[0.45, 0.5, 1.3], [0.45, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

class RunErrors : public Program {
 protected:
  json errors(const std::string& arguments) {
    write("scene.json", kScene);
    const Outcome outcome = cutproof("run scene.json --json out.json " + arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("\nerrors\n"), std::string::npos) << outcome.output;
    return json::parse(read("out.json")).at("errors");
  }
};

TEST_F(RunErrors, AllOfThem) {
  for (const std::string backend : {"reference", "host"}) {
    const json all = errors("--errors all --backend " + backend);
    EXPECT_EQ(all.size(), 6u) << all;

    const json& geometry = all.at("geometry");
    EXPECT_NEAR(geometry.at("cut_area").get<double>(), 25, 1e-9);
    EXPECT_EQ(geometry.at("lost_volume"), 25);
    EXPECT_NEAR(geometry.at("lost_per_area").get<double>(), 1, 1e-9);
    EXPECT_NEAR(geometry.at("least_per_area").get<double>(), 1, 1e-9);
    EXPECT_NEAR(geometry.at("skin_to_ideal").get<double>(), 0.7, 1e-9);
    EXPECT_EQ(geometry.at("interpenetration").at("volume"), 0);

    const json& topology = all.at("topology");
    EXPECT_EQ(topology.at("components"), 2);
    EXPECT_EQ(topology.at("couplings"), 2);
    EXPECT_EQ(topology.at("shells"), 2);
    EXPECT_GE(topology.at("frames"), 2);
    EXPECT_EQ(topology.at("unequal"), 0);
    EXPECT_EQ(topology.at("first_unequal"), nullptr);
    EXPECT_EQ(topology.at("isolated"), 0);

    // Nothing moves in this scene.
    const json& solver = all.at("solver");
    EXPECT_LT(solver.at("max"), backend == "reference" ? 1e-12 : 1e-5);
    EXPECT_EQ(solver.at("frames").size(), 7u) << "the scene has no more";
    for (const json& frame : solver.at("frames")) {
      EXPECT_TRUE(frame.at("solved_by") == "minimum" && frame.at("by_energy") && frame.at("converged"));
    }
    const json& time_step = all.at("time_step");
    EXPECT_EQ(time_step.at("first_difference"), nullptr);
    EXPECT_EQ(time_step.at("rms").size(), time_step.at("frames"));
    EXPECT_LT(time_step.at("greatest_rms"), backend == "reference" ? 1e-12 : 1e-4);

    const json& implementation = all.at("implementation");
    EXPECT_EQ(implementation.at("topology_differences"), 0);
    EXPECT_EQ(implementation.at("position").at("max") == 0, backend == "reference");
    EXPECT_LT(implementation.at("position").at("max"), 1e-4);

    const json& conservation = all.at("conservation");
    EXPECT_TRUE(conservation.at("holds"));
    EXPECT_EQ(conservation.at("substeps"), 4000);
    EXPECT_LE(conservation.at("momentum"), conservation.at("momentum_bound"));
    EXPECT_LE(conservation.at("energy"), conservation.at("energy_bound"));
  }
}

TEST_F(RunErrors, OnlyThoseThatAreAskedFor) {
  const json some = errors("--errors topology,geometry");
  EXPECT_EQ(some.size(), 2u) << some;
  EXPECT_TRUE(some.contains("topology") && some.contains("geometry"));
  write("scene.json", kScene);
  ASSERT_EQ(cutproof("run scene.json --json none.json").status, 0);
  EXPECT_FALSE(json::parse(read("none.json")).contains("errors"));
}

// Of a press every frame has an answer of its own, which is none of the iteration's: its floor and its blade have
// friction, and nothing is minimised.
TEST_F(RunErrors, UnderADentingBladeEachFrameHasAnAnswerOfItsOwn) {
  const Outcome outcome = cutproof("run " + scene("cuboid_press") +
                                   " --particles 400 --frames 12 --errors solver,time_step --error-frames 100 "
                                   "--json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json errors = json::parse(read("out.json")).at("errors");
  const json& frames = errors.at("solver").at("frames");
  EXPECT_EQ(frames.size(), 12u) << "all that there are";
  for (const json& frame : frames) {
    EXPECT_EQ(frame.at("solved_by"), "rest");
    EXPECT_FALSE(frame.at("by_energy"));
    EXPECT_TRUE(frame.at("converged"));
    EXPECT_EQ(frame.at("energy"), nullptr);
    EXPECT_EQ(frame.at("elsewhere"), nullptr);
  }
  EXPECT_GT(errors.at("solver").at("max"), 0);
  EXPECT_GT(errors.at("time_step").at("greatest_rms"), 0);
}

TEST_F(RunErrors, RefusesWhatIsNoError) {
  write("scene.json", kScene);
  expect_refused("run scene.json --errors speed", {"--errors", "speed", "time_step"});
  expect_refused("run scene.json --errors geometry,,topology", {"--errors"});
  expect_refused("run scene.json --errors solver --error-frames 0", {"--error-frames"});
  expect_refused("run scene.json --error-frames 4", {"--errors"});
}

}  // namespace
}  // namespace errors_test
