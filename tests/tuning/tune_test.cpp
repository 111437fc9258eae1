// `cutproof tune` as a user meets it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "benchmarks/prepared_scene.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/program.h"

namespace tune_test {
namespace {

using cutproof::Scene;
using nlohmann::json;

// A block hangs from its end while a blade cuts off another. Sixteen iterations are many more than it needs.
constexpr const char* kScene = R"({"version": 5, "name": "hanging",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.03, 0.03]}, "spacing": 0.01}, "clusters": {"side": 2},
  "frame": {"settle": 0.064}, "detect": {"criterion": "geometric"},
  "step": {"substeps": 4, "iterations": 16, "acceleration": "none", "gravity": [0, 0, -9.81], "damping": 5},
  "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1]}, {"low": [0.8, 0, 0], "high": [1, 1, 1]}],
  "blade": {"speed": 1, "strokes": [{"points": [[0.45, 0.5, 1.3], [0.45, 0.5, -0.3]], "along": [0, 1, 0]}]},
  "expect": {"components_after_stroke": [2], "components_at_end": 2}})";

class Tune : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("scene.json", kScene);
  }
  Outcome tune(const std::string& arguments) { return cutproof("tune scene.json --repeats 1 " + arguments); }
};

// RMS distance of a scene's run from that of the same scene with other substeps and iterations: without the library's
// notion of a reference solution.
double greatest_rms_h(const Scene& tuned, Scene scene, int substeps, int iterations,
                      std::optional<int64_t> frames = {}) {
  scene.step.substeps = substeps;
  scene.step.iterations = iterations;
  const cutproof::benchmarks::PreparedScene a(scene, "test", frames), b(tuned, "test", frames);
  const auto first = cutproof::reference::make_backend(), second = cutproof::reference::make_backend();
  first->load({a.setup()}, {a.start()});
  second->load({b.setup()}, {b.start()});
  EXPECT_EQ(a.frame_count(), b.frame_count());
  double greatest = 0;
  for (int64_t frame = 0; frame < a.frame_count(); ++frame) {
    const auto run = [](cutproof::Backend& backend) { backend.run({cutproof::Stage::step, cutproof::Stage::skin}); };
    a.for_parts_of(frame, [&] { run(*first); });
    b.for_parts_of(frame, [&] { run(*second); });
    const cutproof::State x = first->snapshot().front(), y = second->snapshot().front();
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < x.x.size(); ++i) {
      if (!x.alive[i] || !y.alive[i]) continue;
      const cutproof::Vec3 d = x.x[i] - y.x[i];
      squares += dot(d, d);
      count += 1;
    }
    greatest = std::max(greatest, std::sqrt(squares / count) / a.setup().body.grid.spacing);
  }
  return greatest;
}

TEST_F(Tune, WritesACheaperSceneWithinTheTolerance) {
  // So many iterations that a frame costs ten times what it has to, however busy the machine is.
  constexpr int kIterations = 256;
  std::string text = kScene;
  const std::string given_iterations = "\"iterations\": 16";
  text.replace(text.find(given_iterations), given_iterations.size(), "\"iterations\": " + std::to_string(kIterations));
  write("scene.json", text);
  for (const std::string backend : {"reference", "host"}) {
    const Outcome outcome = tune("--tolerance 0.05 --reference substeps --json out.json --backend " + backend);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("\nfound: "), std::string::npos) << outcome.output;
    const Scene tuned = cutproof::io::read_scene(path("scene_tuned.json"));
    const Scene given = cutproof::io::read_scene(path("scene.json"));
    EXPECT_LT(tuned.step.substeps * tuned.step.iterations, 4 * kIterations);
    const double error = greatest_rms_h(tuned, given, 4, kIterations);
    EXPECT_LE(error, 0.05);

    const json document = json::parse(read("out.json"));
    EXPECT_TRUE(document.at("complete"));
    EXPECT_EQ(document.at("tolerance_h"), 0.05);
    EXPECT_EQ(document.at("reference").at("kind"), "substeps");
    const json& found = document.at("found");
    EXPECT_NEAR(found.at("verified").at("rms_h").get<double>(), error, backend == "host" ? 1e-4 : 1e-8);
    EXPECT_GT(found.at("verdicts"), 10);
    const json& trials = document.at("trials");
    EXPECT_EQ(trials.at(0).at("substeps"), 4);
    EXPECT_EQ(trials.at(0).at("iterations"), kIterations);
    EXPECT_EQ(trials.at(0).at("outcome"), "within");
    // What it has tried and found wanting is written too.
    EXPECT_TRUE(std::any_of(trials.begin(), trials.end(), [](const json& t) { return t.at("outcome") == "over"; }));
    EXPECT_EQ(found.at("verified").at("outcome"), "within");
    EXPECT_EQ(trials.at(found.at("trial").get<std::size_t>()).at("outcome"), "within");
    for (const json& trial : trials) {
      EXPECT_EQ(trial.at("seconds_per_frame").is_null(), trial.at("outcome") != "within") << trial;
      if (trial.at("outcome") == "within") {
        EXPECT_LE(trial.at("rms_h"), 0.05);
      }
    }
    EXPECT_EQ(cutproof("run scene_tuned.json --check --backend " + backend).status, 0);
  }
}

// The first frames of three_cuts, in which the block meets the ground, beside 256 plain iterations of each substep: as
// the scene is given, and as it would be without the default of its version.
TEST(ScenesOfTheProject, AreWithinATwentiethOfASpacingOfTheirOwnSubstepsSolved) {
  const Scene given = cutproof::io::read_scene(CUTPROOF_SOURCE "/fixtures/scenes/three_cuts.json");
  Scene plain = given;
  plain.step.acceleration = cutproof::Acceleration::none;
  constexpr int64_t kFrames = 6;
  EXPECT_LE(greatest_rms_h(given, plain, given.step.substeps, 256, kFrames), 0.05);
  EXPECT_GT(greatest_rms_h(plain, plain, given.step.substeps, 256, kFrames), 0.05);
}

TEST_F(Tune, AgainstTheLimitOfShortTimeSteps) {
  const Outcome outcome = tune("--tolerance 0.3 --write found.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const Scene given = cutproof::io::read_scene(path("scene.json"));
  EXPECT_LE(greatest_rms_h(cutproof::io::read_scene(path("found.json")), given, 512, 4), 0.3);
}

struct Dissected {
  std::vector<int64_t> gone;  // the frame at whose end each particle is gone; as many as there are frames: none
  // By frame: who is alive, and of each cluster its members.
  std::vector<std::vector<uint8_t>> alive;
  std::vector<std::set<std::vector<int32_t>>> clusters;
};
Dissected dissected(Scene scene, int substeps, int iterations) {
  scene.step.substeps = substeps;
  scene.step.iterations = iterations;
  const cutproof::benchmarks::PreparedScene prepared(scene, "test", {});
  const auto backend = cutproof::reference::make_backend();
  backend->load({prepared.setup()}, {prepared.start()});
  Dissected run;
  run.gone.assign(prepared.start().x.size(), prepared.frame_count());
  for (int64_t frame = 0; frame < prepared.frame_count(); ++frame) {
    prepared.for_parts_of(frame, [&] { backend->run({cutproof::Stage::step, cutproof::Stage::skin}); });
    const cutproof::State state = backend->snapshot().front();
    for (std::size_t i = 0; i < run.gone.size(); ++i) {
      if (!state.alive[i]) run.gone[i] = std::min(run.gone[i], frame);
    }
    run.alive.push_back(state.alive);
    run.clusters.emplace_back();
    for (int32_t c = 0; c < state.clusters.count(); ++c) {
      const auto members = state.clusters.of(c);
      run.clusters.back().emplace(members.begin(), members.end());
    }
  }
  return run;
}

// A cut that motion decides: distances halve until a removal falls into another frame.
TEST_F(Tune, TellsWhichRemovalsItsLevelsDoNotShare) {
  std::string text = kScene;
  const auto replace = [&](const std::string& what, const std::string& by) {
    ASSERT_NE(text.find(what), std::string::npos) << what;
    text.replace(text.find(what), what.size(), by);
  };
  replace(R"("detect": {"criterion": "geometric"},)", R"("detect": {"remove": "both"},)");
  replace(R"("substeps": 4)", R"("substeps": 4, "stiffness": 2000)");
  replace(R"(, {"low": [0.8, 0, 0], "high": [1, 1, 1]})", "");
  write("scene.json", text);
  const Outcome outcome = tune("--tolerance 1e-9 --json out.json");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  const json levels = json::parse(read("out.json")).at("reference").at("levels");
  ASSERT_EQ(levels.size(), 5u);
  EXPECT_FALSE(levels.front().contains("alive_in_one")) << "there is none before it";
  const Scene given = cutproof::io::read_scene(path("scene.json"));
  int64_t most = 0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const auto run = [&](std::size_t level) {
      return dissected(given, levels[level].at("substeps").get<int>(), levels[level].at("iterations").get<int>());
    };
    const Dissected one = run(k - 1), other = run(k);
    const std::vector<int64_t>&before = one.gone, &now = other.gone;
    const int64_t end = *std::max_element(now.begin(), now.end());  // whoever is never removed is gone then
    int64_t in_another_frame = 0, alive_in_one = 0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] != before[i]) ++(now[i] < end && before[i] < end ? in_another_frame : alive_in_one);
    }
    EXPECT_EQ(levels[k].at("removed_in_another_frame"), in_another_frame) << "level " << k;
    EXPECT_EQ(levels[k].at("alive_in_one"), alive_in_one) << "level " << k;
    int64_t clusters_in_one = 0;
    for (std::size_t f = 0; f < one.clusters.size(); ++f) {
      if (one.alive[f] != other.alive[f]) continue;
      for (const auto& [a, b] : {std::pair(&one, &other), {&other, &one}}) {
        const std::set<std::vector<int32_t>>& theirs = b->clusters[f];
        clusters_in_one = std::max(clusters_in_one, std::count_if(a->clusters[f].begin(), a->clusters[f].end(),
                                                                  [&](const auto& c) { return !theirs.contains(c); }));
      }
    }
    EXPECT_EQ(levels[k].at("clusters_in_one"), clusters_in_one) << "level " << k;
    if (in_another_frame == 0 && alive_in_one == 0 && k > 1) {
      EXPECT_GT(levels[k].at("order"), 0.9) << "level " << k;
    }
    most = std::max({most, in_another_frame, alive_in_one});
  }
  ASSERT_GT(most, 0) << "a case in which nothing differs asks nothing";
  EXPECT_NE(outcome.output.find(std::to_string(most) + " particle"), std::string::npos) << outcome.output;
}

TEST_F(Tune, SaysThatThereIsNone) {
  // The limit is not known so well.
  const Outcome unknown = tune("--tolerance 1e-9 --frames 2");
  EXPECT_EQ(unknown.status, 1) << unknown.output;
  EXPECT_NE(unknown.output.find("is known to"), std::string::npos) << unknown.output;
  EXPECT_EQ(listing(), std::set<std::string>{"scene.json"}) << "nothing was found, so nothing is written";
}

TEST_F(Tune, KeepsAMeshWithinReachAndSaysWhatItsRepairDid) {
  files::create_directories(path("meshes"));
  files::create_directories(path("found"));
  write("meshes/tetrahedron.off", "OFF\n4 3 0\n0 0 0\n60 0 0\n0 60 0\n0 0 60\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  write("scene.json",
        R"({"version": 5, "body": {"mesh": {"file": "meshes/tetrahedron.off", "unit": 0.001, "repair": true},
    "spacing": 0.008}, "frame": {"count": 2}, "step": {"acceleration": "none", "gravity": [0, 0, -9.81]}})");
  const Outcome outcome = tune("--tolerance 0.2 --reference substeps --write found/tuned.json --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("repaired: 1 hole filled"), std::string::npos) << outcome.output;
  const json build = json::parse(read("out.json")).at("build");
  EXPECT_EQ(build.at("repair").at("steps").at(0).at("name"), "holes_filled") << build;
  EXPECT_EQ(cutproof::io::read_scene(path("found/tuned.json")).body.mesh->file, "../meshes/tetrahedron.off");
  EXPECT_EQ(cutproof("run found/tuned.json --check").status, 0);
}

TEST_F(Tune, RunsEverythingToItsEndForACurve) {
  const Outcome outcome = tune("--tolerance 0.02 --reference substeps --full --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  int over = 0;
  const json document = json::parse(read("out.json"));
  for (const json& trial : document.at("trials")) {
    EXPECT_FALSE(trial.at("seconds_per_frame").is_null());
    EXPECT_EQ(trial.at("rms_h_by_frame").size(), document.at("trials").at(0).at("rms_h_by_frame").size());
    over += trial.at("outcome") == "over";
  }
  EXPECT_GT(over, 0);
}

// Times that a front is read from are of as many runs as were asked for, in turns; the others only say where they are.
TEST_F(Tune, RepeatsWhatMayBeAPointOfTheFront) {
  const Outcome outcome =
      cutproof("tune scene.json --tolerance 0.02 --reference substeps --full --repeats 4 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  const json& trials = document.at("trials");
  EXPECT_EQ(trials.at(0).at("timed_runs"), 4);
  int on_the_front = 0, once = 0;
  for (const json& point : document.at("front")) {
    if (point.at("trial").is_null()) continue;
    EXPECT_EQ(trials.at(point.at("trial").get<std::size_t>()).at("timed_runs"), 4);
    ++on_the_front;
  }
  EXPECT_GT(on_the_front, 0);
  for (const json& trial : trials) {
    if (trial.at("timed_runs") == 4) continue;
    EXPECT_LE(trial.at("timed_runs"), 3);
    once += trial.at("timed_runs") == 1;
  }
  EXPECT_GT(once, 0);
}

TEST_F(Tune, WithoutASkin) {
  const Outcome outcome = tune("--tolerance 0.05 --reference substeps --without-skin --backend host");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("no skin"), std::string::npos) << outcome.output;

  // Who counts shells looks at the skin.
  write("scene.json",
        std::string(kScene).replace(std::string(kScene).find("\"components_at_end\": 2"), 0, "\"shells_at_end\": 2, "));
  const Outcome with_shells =
      tune("--tolerance 0.05 --reference substeps --without-skin --backend host --json out.json");
  ASSERT_EQ(with_shells.status, 0) << with_shells.output;
  EXPECT_NE(with_shells.output.find("--without-skin has no effect"), std::string::npos) << with_shells.output;
  const json document = json::parse(read("out.json"));
  for (const json& trial : document.at("trials")) {
    EXPECT_EQ(trial.at("differences").get<std::string>().find("no skin"), std::string::npos);
  }
}

// A path of several pieces takes whole substeps for each, so another number of substeps may take another number of
// frames. Such runs are not compared.
TEST_F(Tune, LeavesWhatHasAnotherSchedule) {
  write("scene.json", R"({"version": 5, "body": {"shape": {"kind": "box", "size": [0.05, 0.03, 0.03]}, "spacing": 0.01},
    "frame": {"length": 0.016}, "detect": {"criterion": "geometric"}, "step": {"substeps": 4, "iterations": 2, "acceleration": "none"},
    "blade": {"speed": 0.5, "strokes": [{"along": [0, 1, 0], "points": [[0.5, 0.5, 1.3], [0.5, 0.5, 1.29],
    [0.5, 0.5, 1.2], [0.5, 0.5, 1.19], [0.5, 0.5, 1.0], [0.5, 0.5, 0.99], [0.5, 0.5, 0.5]]}]}})");
  const Outcome outcome = tune("--tolerance 0.5 --reference substeps --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json trials = json::parse(read("out.json")).at("trials");
  EXPECT_TRUE(std::any_of(trials.begin(), trials.end(), [](const json& t) { return t.at("outcome") == "schedule"; }))
      << outcome.output;
}

TEST_F(Tune, LooksAtTheFirstFrames) {
  const Outcome outcome = tune("--tolerance 0.1 --reference substeps --frames 1");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("only 1 frames were judged"), std::string::npos) << outcome.output;
}

TEST_F(Tune, RefusesWhatItCannotTune) {
  const auto refused = [&](const std::string& arguments, const std::string& says) {
    const Outcome outcome = cutproof("tune " + arguments);
    EXPECT_EQ(outcome.status, 2) << outcome.output;
    EXPECT_NE(outcome.output.find(says), std::string::npos) << outcome.output;
  };
  refused("", "scene");
  refused("scene.json", "--tolerance");
  refused("scene.json --tolerance -1", "--tolerance");
  refused("scene.json --tolerance nan", "--tolerance");
  refused("scene.json --tolerance 1 --reference best", "--reference");
  refused("scene.json --tolerance 1 --backend simulated", "--backend");
  refused("scene.json --tolerance 1 --write scene.json", "--write");
  refused("scene.json --tolerance 1 --json scene.json", "--json");
  refused("scene.json --tolerance 1 --json found.json --write found.json", "--json");
  refused("scene.json --tolerance 1 --write nowhere/found.json", "nowhere");
  refused("missing.json --tolerance 1", "missing.json");
  write("published.json", R"({"version": 5, "body": {"shape": {"kind": "box"}, "particles": 100},
    "frame": {"count": 1}, "step": {"solver": "published"}})");
  refused("published.json --tolerance 1", "step.solver");
  write("still.json", R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.02}})");
  refused("still.json --tolerance 1", "frame.count");
  EXPECT_EQ(listing(), (std::set<std::string>{"published.json", "scene.json", "still.json"}));
}

}  // namespace
}  // namespace tune_test
