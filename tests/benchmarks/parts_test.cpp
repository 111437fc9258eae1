// `cutproof bench parts`: what is left out is what is named, distances are what leaving it out does, and how many
// particles a step takes one by one is what the kernels did. What the times are is not tested.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "benchmarks/least_squares.h"
#include "benchmarks/prepared_scene.h"
#include "benchmarks/scene_parts.h"
#include "gpu/backends.h"
#include "model/io/scene_io.h"
#include "tests/program.h"

namespace parts_test {
namespace {

using cutproof::Scene;
using cutproof::Stage;
using cutproof::benchmarks::parts_of;
using cutproof::benchmarks::PreparedScene;
using cutproof::benchmarks::ScenePart;
using cutproof::benchmarks::slopes_of;
using cutproof::gpu::StepWork;
using nlohmann::json;

// A block that lies on the ground, held at one end; a blade goes through its middle, and its other end is pulled away
// once it has.
constexpr const char* kScene = R"({"version": 5, "name": "everything",
  "body": {"shape": {"kind": "box", "size": [0.12, 0.04, 0.04]}, "spacing": 0.01}, "clusters": {"side": 3},
  "frame": {"settle": 0.08}, "split": {"debris": 4},
  "step": {"substeps": 2, "iterations": 3, "gravity": [0, 0, -9.81], "damping": 5, "retardation": 0.002},
  "walls": [{"axis": 2, "side": 1, "offset": 0, "friction": 0.3}],
  "grips": [{"low": [0, 0, 0], "high": [0.15, 1, 1]},
            {"low": [0.9, 0, 0], "high": [1, 1, 1], "after_strokes": true, "velocity": [0.1, 0, 0], "end": 0.032}],
  "blade": {"speed": 0.5, "friction": 0.1,
            "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

Scene everything() { return cutproof::io::parse_scene(kScene, "test"); }

class BenchParts : public Program {
 protected:
  void write_scene() { write("everything.json", kScene); }
};

std::vector<std::string> names_of(const std::vector<ScenePart>& parts) {
  std::vector<std::string> names;
  for (const ScenePart& part : parts) names.push_back(part.name);
  return names;
}
const Scene& without(const std::vector<ScenePart>& parts, const std::string& name) {
  for (const ScenePart& part : parts) {
    if (part.name == name) return part.without;
  }
  throw std::out_of_range(name);
}

TEST(SceneParts, AreThoseThatASceneHas) {
  const Scene scene = everything();
  EXPECT_EQ(names_of(parts_of(scene, 20, 0.2)),
            (std::vector<std::string>{"acceleration", "retardation", "blade", "walls", "friction", "grips", "detection",
                                      "choice of ends", "debris", "merging", "expansion", "skin", "fitted skin"}));
  Scene geometric = scene;
  geometric.detect.criterion = cutproof::Criterion::geometric;
  for (const ScenePart& part : parts_of(geometric, 20, 0.2)) EXPECT_NE(part.name, "detection") << "it would push";
  Scene bare;
  bare.body = scene.body;
  bare.body.fit_skin = false;
  bare.step.acceleration = cutproof::Acceleration::none;
  bare.merge.rule = cutproof::MergeRule::none;
  bare.expand.rule = cutproof::ExpandRule::none;
  bare.skin = {.wanted = false};
  EXPECT_TRUE(parts_of(bare, 20, {}).empty());
  bare.skin.wanted = true;
  EXPECT_EQ(names_of(parts_of(bare, 20, {})), std::vector<std::string>{"skin"});
}

TEST(SceneParts, LeaveOutOneThingAndKeepTheRest) {
  const Scene scene = everything();
  const std::vector<ScenePart> parts = parts_of(scene, 20, 0.2);
  Scene as_long = scene;
  as_long.frames = 20;
  for (const ScenePart& part : parts) EXPECT_NE(part.without, as_long) << part.name;
  Scene expected = as_long;
  expected.split.debris = 0;
  EXPECT_EQ(without(parts, "debris"), expected);
  expected = as_long;
  expected.skin.wanted = false;
  EXPECT_EQ(without(parts, "skin"), expected);
  expected = as_long;
  expected.blade->friction = 0;
  expected.walls.front().friction = 0;
  EXPECT_EQ(without(parts, "friction"), expected);
  expected = as_long;
  expected.detect.remove = cutproof::RemovedEnds::both;
  EXPECT_EQ(without(parts, "choice of ends"), expected);
}

TEST(SceneParts, SaysWhatClustersAreCookedBy) {
  std::set<std::string> cooks;
  for (const ScenePart& part : parts_of(everything(), 20, 0.2)) {
    const PreparedScene given(everything(), "test", 1), prepared(part.without, "test", 1);
    if (part.cooks) cooks.insert(part.name);
    const auto &a = given.start().clusters, &b = prepared.start().clusters;
    if (a.offsets != b.offsets || a.members != b.members) {
      EXPECT_TRUE(part.cooks) << part.name;
    }
  }
  EXPECT_EQ(cooks, (std::set<std::string>{"merging", "expansion"}));
}

// In tissue that nothing cuts no stage of clusters runs, so a run without them is the same.
TEST_F(BenchParts, LeavesStagesOutOfTheFramesAndClustersAsTheyWereCooked) {
  write("uncut.json", R"({"version": 5, "name": "uncut", "frame": {"count": 4},
    "body": {"shape": {"kind": "box", "size": [0.11, 0.04, 0.04]}, "spacing": 0.01}, "clusters": {"side": 2},
    "step": {"gravity": [0, 0, -9.81]}, "grips": [{"low": [0, 0, 0], "high": [0.15, 1, 1]}]})");
  ASSERT_EQ(cutproof("bench parts uncut.json --repeats 1 --json out.json").status, 0);
  std::set<std::string> still;
  const json document = json::parse(read("out.json"));
  for (const json& row : document.at("rows")) {
    if (!row.at("without").is_null() && row.at("error").at("max_h") == 0) still.insert(row.at("without"));
  }
  EXPECT_TRUE(still.contains("merging"));
  EXPECT_TRUE(still.contains("expansion"));
  EXPECT_FALSE(still.contains("grips"));
}

// A scene may end with its blade, or with a grip.
TEST(SceneParts, LeaveAsManyFrames) {
  Scene scene = everything();
  scene.blade.reset();
  scene.grips.resize(1);
  scene.grips.front().end = 0.16;
  const int64_t frames = PreparedScene(scene, "test", {}).frame_count();
  EXPECT_EQ(frames, 15) << "while the grip holds, and until all has settled";
  for (const ScenePart& part : parts_of(scene, frames, {})) {
    EXPECT_EQ(PreparedScene(part.without, "test", {}).frame_count(), frames) << part.name;
  }
}

TEST(SceneParts, WithoutABladeAllElseHappensWhenItDid) {
  const PreparedScene given(everything(), "test", {});
  const double end = static_cast<double>(given.stroke_end().back() + 1) * everything().frame_length;
  const Scene bare = without(parts_of(everything(), given.frame_count(), end), "blade");
  const PreparedScene prepared(bare, "test", {});
  EXPECT_EQ(prepared.frame_count(), given.frame_count());
  ASSERT_EQ(prepared.setup().grips.size(), 2U);
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_EQ(prepared.setup().grips[g].particles, given.setup().grips[g].particles);
    EXPECT_EQ(prepared.setup().grips[g].active, given.setup().grips[g].active) << g;
  }
  // Where the frames end before, nobody is gripped after the strokes.
  EXPECT_EQ(without(parts_of(everything(), 3, {}), "blade").grips.size(), 1U);
}

// By hand: slope 1/2, residuals -1/6, 1/3 and -1/6, so (1/6 / 1 / 2)^(1/2).
TEST(LeastSquares, GivesTheSlopeAndItsStandardError) {
  const auto slope = slopes_of({{0, 1, 2}}, {0, 1, 1}).front();
  ASSERT_TRUE(slope.has_value());
  EXPECT_NEAR(slope->value, 0.5, 1e-15);
  EXPECT_NEAR(slope->standard_error, std::sqrt(1.0 / 12), 1e-15);
}

// y = 7 + 2 a - 3 b, with another column that has nothing to do with it, and one that does not change.
TEST(LeastSquares, TellsColumnsApart) {
  const std::vector<double> a = {0, 1, 2, 3, 4, 5}, b = {1, 0, 1, 0, 0, 1}, other = {1, 4, 1, 5, 9, 2};
  std::vector<double> y;
  for (std::size_t k = 0; k < a.size(); ++k) y.push_back(7 + 2 * a[k] - 3 * b[k]);
  const auto slopes = slopes_of({a, {4, 4, 4, 4, 4, 4}, b, other}, y);
  ASSERT_TRUE(slopes[0] && slopes[2] && slopes[3]);
  EXPECT_FALSE(slopes[1].has_value());
  EXPECT_NEAR(slopes[0]->value, 2, 1e-13);
  EXPECT_NEAR(slopes[2]->value, -3, 1e-13);
  EXPECT_NEAR(slopes[3]->value, 0, 1e-13);
  EXPECT_NEAR(slopes[2]->standard_error, 0, 1e-13);
}

TEST(LeastSquares, SaysNothingWhereNothingTells) {
  EXPECT_FALSE(slopes_of({{1, 1, 1, 1}}, {1, 2, 3, 4}).front().has_value());
  EXPECT_FALSE(slopes_of({{1, 2}}, {1, 2}).front().has_value()) << "no error can be told";
  EXPECT_FALSE(slopes_of({{}}, {}).front().has_value());
  for (const auto& slope : slopes_of({{1, 2, 3, 4}, {3, 5, 7, 9}}, {1, 2, 4, 4})) {
    EXPECT_FALSE(slope.has_value()) << "both columns are one";
  }
}

// ---- what a step does with its particles, on one thread, several, and as kernels of many threads

class StepWorkOf : public testing::TestWithParam<int> {
 protected:
  // After so many frames, and the step of the next one.
  static StepWork after(const PreparedScene& scene, int64_t frames) {
    const auto backend = cutproof::gpu::make_host_backend(GetParam() == 1 ? 1 : 2, {}, GetParam());
    backend->load({scene.setup()}, {scene.start()});
    for (int64_t frame = 0; frame < frames; ++frame) scene.for_parts_of(frame, [&] { backend->run({}); });
    backend->run({Stage::step, Stage::step});
    const cutproof::State state = backend->snapshot().front();
    const auto& kernels = dynamic_cast<const cutproof::gpu::KernelBackend&>(*backend);
    const StepWork work = kernels.step_work();
    EXPECT_EQ(work.carried + work.held + work.resolved + work.loose,
              std::accumulate(state.alive.begin(), state.alive.end(), int64_t{0}));
    return work;
  }
};

TEST_P(StepWorkOf, ABodyThatNothingTouchesIsCarried) {
  Scene scene = everything();
  scene.blade.reset();
  scene.grips.clear();
  scene.frames = 4;
  scene.walls.front().offset = -100;
  const StepWork falling = after(PreparedScene(scene, "test", {}), 1);
  EXPECT_EQ(falling.resolved, 0);
  EXPECT_EQ(falling.held, 0);
  EXPECT_GT(falling.carried, 0);
  scene.walls.clear();  // kernels that know no contacts
  scene.step.retardation = 0;
  const StepWork free = after(PreparedScene(scene, "test", {}), 1);
  EXPECT_EQ(free.resolved, 0);
  EXPECT_EQ(free.carried, falling.carried);
  EXPECT_EQ(free.loose, falling.loose);
}

TEST_P(StepWorkOf, AGripHoldsTheGroupsOfItsParticles) {
  Scene scene = everything();
  scene.blade.reset();
  scene.walls.clear();
  scene.grips.resize(1);
  scene.frames = 4;
  const PreparedScene prepared(scene, "test", {});
  const auto named = static_cast<int64_t>(prepared.setup().grips.front().particles.size());
  const StepWork work = after(prepared, 1);
  EXPECT_GT(work.held, 0);
  EXPECT_LE(work.held, named);
  EXPECT_GE(work.held, named - work.loose) << "whoever is held in no group is loose";
  EXPECT_EQ(work.resolved, 0);
}

TEST_P(StepWorkOf, WhatLiesOnTheGroundAndAroundTheBladeIsResolved) {
  const PreparedScene prepared(everything(), "test", {});
  const StepWork early = after(prepared, 1), late = after(prepared, prepared.stroke_end().back() - 2);
  EXPECT_GT(early.resolved, 0) << "the lowest layer";
  EXPECT_GT(late.resolved, early.resolved) << "the blade is in the tissue";
  EXPECT_GT(early.carried, 0);
}

INSTANTIATE_TEST_SUITE_P(ThreadsOfABlock, StepWorkOf, testing::Values(1, 32));

// ---- the program

TEST_F(BenchParts, TellsWhatEachPartCostsBesideWhatItDoes) {
  write_scene();
  const Outcome outcome =
      cutproof("bench parts everything.json --backend host --repeats 2 --json out.json --report out.html");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("suite"), "parts");
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  ASSERT_EQ(document.at("rows").size(), 14U);
  EXPECT_EQ(document.at("rows_at_most"), 14);
  const json& given = document.at("rows").front();
  EXPECT_TRUE(given.at("without").is_null());
  EXPECT_EQ(given.at("of_given"), 1);
  EXPECT_EQ(given.at("error").at("max_h"), 0) << "the same run twice";
  EXPECT_TRUE(given.at("judged").at("topology_holds"));
  EXPECT_LT(given.at("judged").at("step_max_h"), 1e-4);
  EXPECT_GT(given.at("stages").at("detect").at("frames"), 0);
  EXPECT_GT(given.at("work").at("resolved"), 0);
  ASSERT_FALSE(given.at("per_resolved").is_null());
  EXPECT_GT(given.at("per_resolved").at("standard_error"), 0);
  std::set<std::string> still;  // without which all goes where it goes with them
  for (const json& row : document.at("rows")) {
    if (row.at("without").is_null()) continue;
    const std::string part = row.at("without");
    EXPECT_EQ(row.at("refused"), "") << part;
    EXPECT_GT(row.at("seconds_per_frame").at("median"), 0) << part;
    EXPECT_GT(row.at("of_given"), 0) << part;
    EXPECT_LE(row.at("error").at("rms_h"), row.at("error").at("max_h")) << part;
    if (row.at("error").at("max_h") == 0) still.insert(part);
    if (part == "skin") {
      EXPECT_EQ(row.at("stages").at("skin").at("frames"), 0);
    }
    if (part == "grips") {
      EXPECT_EQ(row.at("work").at("held"), 0);
    }
    if (part == "detection" || part == "blade") {
      EXPECT_GT(row.at("error").at("removed_otherwise"), 0) << part;
      EXPECT_FALSE(row.at("error").at("same_components")) << part;
      EXPECT_EQ(row.at("stages").at("split").at("frames"), 0) << part;
    }
  }
  for (const char* part : {"skin", "fitted skin"}) EXPECT_TRUE(still.contains(part)) << part;
  for (const char* part : {"acceleration", "retardation", "blade", "walls", "friction", "grips", "detection"}) {
    EXPECT_FALSE(still.contains(part)) << part;
  }
  const std::string text = on_one_line(outcome.output);
  for (const char* words : {"as it is", "without fitted skin", "a resolved particle adds", "beside the reference"}) {
    EXPECT_NE(text.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
  EXPECT_NE(read("out.html").find("What each part of 1 scene costs"), std::string::npos);
}

TEST_F(BenchParts, OfTheReferenceSaysNothingAboutGroups) {
  write_scene();
  const Outcome outcome = cutproof("bench parts everything.json --frames 2 --repeats 1 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  for (const json& row : document.at("rows")) EXPECT_TRUE(row.at("work").is_null());
  EXPECT_EQ(outcome.output.find("resolved"), std::string::npos) << outcome.output;
}

TEST_F(BenchParts, RefusesBadUsage) {
  write("still.json", R"({"version": 5, "name": "still",
    "body": {"shape": {"kind": "box", "size": [0.04, 0.04, 0.04]}, "spacing": 0.01}, "clusters": {"side": 2}})");
  expect_refused("bench parts still.json", {"still.json", "frame.count"});
  expect_refused("bench parts nothing.json", {"nothing.json"});
  write_scene();
  expect_refused("bench parts everything.json --backend simulated", {"simulated"});
  expect_refused("bench parts everything.json --frames 0", {"--frames"});
  expect_refused("bench parts everything.json --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace parts_test
