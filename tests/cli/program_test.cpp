// The program as a user meets it: scenes, meshes, recordings, bad input, exit statuses.
#include "tests/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

namespace program_test {
namespace {

using nlohmann::json;

json small_block(const std::string& name = "small") {
  return json::parse(R"({"version": 5, "body": {"shape": {"kind": "box", "size": [0.06, 0.05, 0.05]}, "spacing": 0.01},
    "frame": {"settle": 0.032}, "detect": {"criterion": "geometric"},
    "blade": {"speed": 1, "strokes": [{"points": [[0.45, 0.5, 1.3], [0.45, 0.5, -0.3]], "along": [0, 1, 0]}]},
    "expect": {"components_after_stroke": [2], "components_at_end": 2}})")
      .patch(json::array({{{"op", "add"}, {"path", "/name"}, {"value", name}}}));
}

// Backends that run some spans alone.
const std::string kOfWholeFrames = "'plugin:" CUTPROOF_PLUGIN_OF_WHOLE_FRAMES "'";
const std::string kOfSplit = "'plugin:" CUTPROOF_PLUGIN_OF_SPLIT "'";

// --- The paper's scenes ---------------------------------------------------------------------------------------------

struct SceneOn {
  std::string scene, backend, checks;
};
void PrintTo(const SceneOn& tested, std::ostream* os) { *os << tested.scene << " on " << tested.backend; }
class Scene : public Program, public testing::WithParamInterface<SceneOn> {};

TEST_P(Scene, Holds) {
  const Outcome outcome =
      cutproof("run " + scene(GetParam().scene) + " --check " + GetParam().checks + " --backend " + GetParam().backend);
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("0 failed: everything holds."), std::string::npos);
}

std::vector<SceneOn> scenes_and_backends() {
  std::vector<SceneOn> all;
  for (const char* scene :
       {"cuboid_press", "uniform_stretch", "uniform_stretch_strain", "three_cuts", "liver_cut", "kidney_arc",
        "kidney_discontinuous", "irregular_sampled", "irregular_sampled_covered", "small_block", "cylinder"}) {
    for (const char* backend : {"reference", "host", "simulated"}) all.push_back({scene, backend, ""});
  }
  // 37,704 particles, over 10 s each: kernels go other ways where clusters and particles are many, and what the paper
  // says of this size is expected. The motion is judged once.
  for (const char* scene : {"cluster_growth", "kidney_37704"}) {
    all.push_back({scene, "reference", "topology"});
    all.push_back({scene, "host", ""});
    all.push_back({scene, "simulated", "topology"});
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(OfThePaper, Scene, testing::ValuesIn(scenes_and_backends()),
                         [](const auto& instance) { return instance.param.scene + "_on_" + instance.param.backend; });

struct OnMesh {
  std::string scene, mesh;
  int parts = 2;
};
class SceneOnMesh : public Program, public testing::WithParamInterface<OnMesh> {};

TEST_P(SceneOnMesh, HoldsWithEveryCheckOn) {
  const char* meshes = std::getenv("CUTPROOF_MESHES");
  if (meshes == nullptr) GTEST_SKIP() << "CUTPROOF_MESHES is not set";
  json expecting = json::parse(std::ifstream(scene(GetParam().scene)));
  json& expect = expecting.at("expect");
  expect.at("components_after_stroke").back() = GetParam().parts;
  expect.at("components_at_end") = GetParam().parts;
  expect.at("shells_at_end") = GetParam().parts;
  write("scene.json", expecting.dump());
  const Outcome outcome = cutproof("run scene.json --check --mesh " + std::string(meshes) + "/" + GetParam().mesh);
  EXPECT_EQ(outcome.status, 0) << outcome.output;
}

// The liver of sksurgery falls into three: so it does with 32 accelerated and with 128 plain iterations. (With 8 plain
// ones, far from the solution of their substeps, it fell into two.)
INSTANTIATE_TEST_SUITE_P(Organs, SceneOnMesh,
                         testing::Values(OnMesh{"kidney_discontinuous", "openhelp_Kidney_left.stl"},
                                         OnMesh{"kidney_discontinuous", "bp3d_FMA7205_Left_Kidney.obj"},
                                         OnMesh{"liver_cut", "openhelp_Liver.stl"},
                                         OnMesh{"liver_cut", "sksurgery_liver.ply", 3},
                                         OnMesh{"liver_cut", "bp3d_FMA7197_Liver.obj"}),
                         [](const auto& instance) {
                           std::string name = instance.param.scene + "_on_" + instance.param.mesh;
                           for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

struct BadMesh {
  std::string mesh;
  std::vector<std::string> words;
};
class BadOutsideMesh : public Program, public testing::WithParamInterface<BadMesh> {};

TEST_P(BadOutsideMesh, IsRefusedWithItsDefect) {
  const char* meshes = std::getenv("CUTPROOF_MESHES");
  if (meshes == nullptr) GTEST_SKIP() << "CUTPROOF_MESHES is not set";
  expect_refused(
      "run " + scene("liver_cut") + " --check --json out.json --record r --mesh " + meshes + "/" + GetParam().mesh,
      GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(Meshes, BadOutsideMesh,
                         testing::Values(BadMesh{"sksurgery_intraop_surface.stl", {"open", "160 edges", "remedy"}},
                                         BadMesh{"beamadapter_carotids.stl", {"open", "41 edges", "remedy"}},
                                         BadMesh{"sksurgery_Tumor.ply", {"manifold", "31 edges", "remedy"}},
                                         BadMesh{"manifold_self_intersectA.obj", {"crosses itself", "338", "remedy"}},
                                         BadMesh{"sofa_liver-smooth.obj", {"crosses itself", "7 pairs", "810-811"}}),
                         [](const auto& instance) {
                           std::string name = instance.param.mesh;
                           for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

class OutsideMesh : public Program, public testing::WithParamInterface<std::string> {};

TEST_P(OutsideMesh, RunsInEverySceneOfKidneysAndLiversWithRepair) {
  const char* meshes = std::getenv("CUTPROOF_MESHES");
  if (meshes == nullptr) GTEST_SKIP() << "CUTPROOF_MESHES is not set";
  for (const auto& entry : files::directory_iterator(files::path(CUTPROOF_SOURCE) / "fixtures/scenes")) {
    const std::string name = entry.path().filename();
    if (name.find("kidney") == std::string::npos && name.find("liver") == std::string::npos) continue;
    const Outcome outcome =
        cutproof("run '" + entry.path().string() + "' --backend host --particles 1500 --frames 2 " +
                 (GetParam().starts_with("sksurgery_intraop") ? "--repair-change 1 " : "") +  // a sheet
                 "--repair --mesh '" + std::string(meshes) + "/" + GetParam() + "' --json out.json");
    EXPECT_EQ(outcome.status, 0) << name << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find("repair"), std::string::npos) << outcome.output;
    EXPECT_TRUE(json::parse(read("out.json")).at("build").contains("repair"));
  }
}

INSTANTIATE_TEST_SUITE_P(Organs, OutsideMesh,
                         testing::Values("openhelp_Heart.stl", "openhelp_Kidney_left.stl", "beamadapter_carotids.stl",
                                         "sksurgery_Tumor.ply", "sofa_liver-smooth.obj", "bp3d_FMA7197_Liver.obj",
                                         "bp3d_FMA7205_Left_Kidney.obj", "openhelp_Liver.stl", "sksurgery_liver.ply",
                                         "sksurgery_intraop_surface.stl"),
                         [](const auto& instance) {
                           std::string name = instance.param;
                           for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

// --- Meshes -------------------------------------------------------------------------------------------------------

// A cuboid of 60 × 50 × 50 mm; open: without the last triangle.
std::string cuboid(bool is_open) {
  return std::string("OFF\n8 ") + (is_open ? "11" : "12") +
         " 0\n0 0 0\n60 0 0\n60 50 0\n0 50 0\n0 0 50\n60 0 50\n60 50 50\n0 50 50\n"
         "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n" +
         (is_open ? "" : "3 3 4 7\n");
}

TEST_F(Program, ExaminesAMeshWithoutAScene) {
  write("sound.off", cuboid(false));
  write("open.off", cuboid(true));
  const Outcome sound = cutproof("info --mesh sound.off --json sound.json");
  EXPECT_EQ(sound.status, 0) << sound.output;
  for (const char* word : {"8 vertices, 12 triangles, 1 component", "60 × 50 × 50 mm", "volume 150 cm³", "a solid"}) {
    EXPECT_NE(sound.output.find(word), std::string::npos) << word << " in " << sound.output;
  }
  EXPECT_TRUE(json::parse(read("sound.json")).at("solid"));
  const Outcome open = cutproof("info --mesh open.off --unit cm --json open.json");
  EXPECT_EQ(open.status, 1) << open.output;
  for (const char* word : {"600 × 500 × 500 mm", "the surface is open: 3 edges", "--repair would make it a solid",
                           "1 hole filled with 1 triangle", "volume 1.5e+05 cm³"}) {
    EXPECT_NE(open.output.find(word), std::string::npos) << word << " in " << open.output;
  }
  const json found = json::parse(read("open.json"));
  EXPECT_FALSE(found.at("solid"));
  EXPECT_EQ(found.at("defects").size(), 1U);
  EXPECT_TRUE(found.at("repair").at("solid"));
  EXPECT_EQ(found.at("repair").at("steps").at(0).at("name"), "holes_filled");
  EXPECT_NEAR(found.at("repair").at("volume").get<double>(), 0.15, 1e-12);
  expect_refused("info --mesh missing.off", {"missing.off"});
  expect_refused("info --mesh sound.off --unit inch", {"--unit", "mm, cm, m"});
}

TEST_F(Program, RepairsAMeshOnlyIfAskedAndSaysWhatItDid) {
  write("open.off", cuboid(true));
  write("cut.json", small_block().dump());
  expect_refused("run cut.json --mesh open.off", {"the surface is open", "--repair", "\"repair\": true"});
  expect_refused("run cut.json --repair", {"--repair", "--mesh"});
  const Outcome outcome = cutproof("run cut.json --check --mesh open.off --repair --json out.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("repaired: 1 hole filled with 1 triangle"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("the volume is unchanged"), std::string::npos) << outcome.output;
  const json build = json::parse(read("out.json")).at("build");
  EXPECT_EQ(build.at("repair").at("steps").at(0).at("count"), 1);
  EXPECT_FALSE(build.at("repair").at("made_up"));
}

TEST_F(Program, NotesWhatAnOrganThatTheSceneWasNotMadeForChanges) {
  json pulled = small_block();
  pulled["grips"] = json::parse(R"([{"low": [1.2, 0, 0], "high": [1.4, 1, 1]}])");
  write("pulled.json", pulled.dump());
  const Outcome grip = cutproof("run pulled.json --json out.json");
  EXPECT_EQ(grip.status, 0) << grip.output;
  EXPECT_NE(grip.output.find("note: grips[0]: no particle rests in its region"), std::string::npos) << grip.output;
  EXPECT_EQ(json::parse(read("out.json")).at("build").at("notes").size(), 1U);
  write("sound.off", cuboid(false));
  write("cut.json", small_block().dump());
  const Outcome unit = cutproof("run cut.json --mesh sound.off --unit m");
  EXPECT_EQ(unit.status, 2) << unit.output;
  EXPECT_NE(unit.output.find("if its numbers are mm, use --unit mm"), std::string::npos) << unit.output;
  expect_remedy(unit.output);
}

// --- What a scene expects -------------------------------------------------------------------------------------------

TEST_F(Program, FailsWithStatusOneWhenAnExpectationDoesNotHold) {
  json wrong = small_block();
  wrong["expect"]["components_at_end"] = 3;
  write("wrong.json", wrong.dump());
  const Outcome outcome = cutproof("run wrong.json --check");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("at the end there are 2, expected 3"), std::string::npos) << outcome.output;
}

TEST_F(Program, CallsIsolationAFailureUnlessTheSceneExpectsIt) {
  std::ifstream file(scene("irregular_sampled"));
  json foreign = json::parse(file);
  foreign["expect"].erase("isolated_clusters");
  foreign["frame"] = {{"length", 0.016}, {"count", 30}};  // the first is isolated in frame 24
  write("isolated.json", foreign.dump());
  const Outcome outcome = cutproof("run isolated.json --check topology");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("FAILS: isolation"), std::string::npos) << outcome.output;
}

// --- What runs in a frame -------------------------------------------------------------------------------------------

TEST_F(Program, NamesInJsonTheStagesThatRanInEachFrame) {
  write("cut.json", small_block().dump());
  ASSERT_EQ(cutproof("run cut.json --json cut_out.json").status, 0);
  bool cut = false, whole = false;
  const json cut_frames = json::parse(read("cut_out.json"))["frames"];
  for (const json& frame : cut_frames) {
    const json with = {"step", "detect", "split", "merge", "skin"}, without = {"step", "detect", "skin"};
    EXPECT_EQ(frame["stages"], frame["removed"] > 0 ? with : without);
    for (const json& stage : frame["stages"]) EXPECT_TRUE(frame["seconds"].contains(stage));
    (frame["removed"] > 0 ? cut : whole) = true;
  }
  EXPECT_TRUE(cut);
  EXPECT_TRUE(whole);
  json idle = small_block();
  idle.erase("blade");
  idle.erase("expect");
  idle["frame"] = {{"count", 3}};
  write("idle.json", idle.dump());
  ASSERT_EQ(cutproof("run idle.json --json idle_out.json").status, 0);
  const json frames = json::parse(read("idle_out.json"))["frames"];
  ASSERT_EQ(frames.size(), 3u);
  for (const json& frame : frames) EXPECT_EQ(frame["stages"], json({"step", "skin"}));
}

TEST_F(Program, EndsWithAReportOnBodiesOfNoneOneAndOneCutAway) {
  json none = small_block();
  none["body"]["shape"] = json::parse(R"({"kind": "difference", "parts": [{"kind": "ball", "radius": 0.02},
                                           {"kind": "ball", "radius": 0.03}]})");
  none.erase("expect");
  write("none.json", none.dump());
  json one = none;
  one["body"] = json::parse(R"({"shape": {"kind": "box", "size": [0.01, 0.01, 0.01]}, "spacing": 0.01})");
  write("one.json", one.dump());
  json away = small_block();
  away["blade"]["thickness"] = 50;
  away["expect"] = {{"components_at_end", 0}, {"shells_at_end", 0}};
  write("away.json", away.dump());
  for (const std::string name : {"none", "one", "away"}) {
    const Outcome outcome = cutproof("run " + name + ".json --check --json " + name + "_out.json --record " + name);
    // Of a body without particles nothing can be judged, and a gate that judged nothing has not passed.
    const int expected = name == "none" ? 1 : 0;
    EXPECT_EQ(outcome.status, expected) << name << "\n" << outcome.output;
    EXPECT_EQ(cutproof("check " + name).status, expected) << name;
  }
  const json verdicts = json::parse(read("none_out.json"))["verdicts"];
  for (const json& verdict : verdicts) EXPECT_EQ(verdict["holds"], verdict["property"] != "something was judged");
  EXPECT_EQ(json::parse(read("none_out.json"))["body"]["particles"], 0);
  EXPECT_EQ(json::parse(read("one_out.json"))["body"]["particles"], 1);
  EXPECT_EQ(json::parse(read("away_out.json"))["frames"].back()["particles"], 0);
}

// --- Recordings -----------------------------------------------------------------------------------------------------

// A recording cannot be run, so relations between runs are asked of the run alone.
json without_relations(const json& verdicts) {
  const std::set<std::string> relations = {"no ghost force", "energy is monotone", "rest is fixed",
                                           "translation is exact", "step by iterates"};
  json others = json::array();
  for (const json& verdict : verdicts) {
    if (!relations.contains(verdict["property"])) others.push_back(verdict);
  }
  return others;
}

bool has_note(const json& document, const std::string& words) {
  for (const json& note : document["notes"]) {
    if (note.get<std::string>().find(words) != std::string::npos) return true;
  }
  return false;
}

// How many there are is no outcome where the command line asks for another number; everything else still is.
TEST_F(Program, AnotherNumberOfParticlesIsNotHeldAgainstTheScenes) {
  json counting = small_block();
  counting["expect"]["particles"] = {{"at_least", 1}, {"at_most", 2}};
  counting["expect"]["clusters"] = {{"at_least", 1000}};
  write("counting.json", counting.dump());
  EXPECT_EQ(cutproof("run counting.json --check").status, 1) << "or this test is about nothing";
  for (const std::string option : {"--particles 150", "--spacing 0.012"}) {
    const Outcome outcome = cutproof("run counting.json --check --json out.json --record seen " + option);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_TRUE(has_note(document, "The expected number of particles and clusters was not judged"));
    EXPECT_NE(outcome.output.find("components at the end:\u00A02"), std::string::npos) << outcome.output;
    const Outcome checked = cutproof("check seen");
    EXPECT_EQ(checked.status, 0) << checked.output;
  }
  const Outcome asked = cutproof("run counting.json --check --particles 150 --set expect.particles.at_most=3");
  EXPECT_EQ(asked.status, 1) << asked.output;
  EXPECT_NE(asked.output.find("expected particles"), std::string::npos) << asked.output;
  EXPECT_EQ(asked.output.find("expected clusters"), std::string::npos) << asked.output;
  counting["expect"]["components_at_end"] = 3;
  write("wrong.json", counting.dump());
  EXPECT_EQ(cutproof("run wrong.json --check --particles 150").status, 1);
}

// A block that is pulled apart by its ends: what goes too far apart goes in the substep in which it does.
TEST_F(Program, DetectsInEverySubstepIfTheSceneSaysSo) {
  json scene = json::parse(R"({"version": 5, "name": "torn",
    "body": {"shape": {"kind": "box", "size": [0.12, 0.04, 0.04]}, "spacing": 0.01},
    "frame": {"count": 12}, "step": {"substeps": 4}, "detect": {"without_blade": true},
    "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1], "velocity": [-0.15, 0, 0]},
              {"low": [0.8, 0, 0], "high": [1, 1, 1], "velocity": [0.15, 0, 0]}]})");
  std::map<std::string, int> first;  // the end of the frame in which tissue first goes, by how often [substeps]
  for (const std::string every : {"frame", "substep"}) {
    scene["detect"]["every"] = every;
    write("torn.json", scene.dump());
    for (const std::string backend : {"reference", "host"}) {
      SCOPED_TRACE(every + " on " + backend);
      const Outcome outcome = cutproof("run torn.json --check --json out.json --backend " + backend);
      EXPECT_EQ(outcome.status, 0) << outcome.output;
      const bool each = every == "substep";
      EXPECT_NE(outcome.output.find(each ? "48 frames of 1 substep ×" : "12 frames of 4 substeps ×"), std::string::npos)
          << outcome.output;
      const json frames = json::parse(read("out.json")).at("frames");
      ASSERT_EQ(frames.size(), each ? 48U : 12U);
      int substeps = 0, found = 0;
      for (const json& frame : frames) {
        substeps += each ? 1 : 4;
        if (found == 0 && frame.at("removed") > 0) found = substeps;
      }
      ASSERT_GT(found, 0) << "nothing was torn";
      if (backend == "host") {
        EXPECT_EQ(first.at(every), found);
      }
      first[every] = found;
    }
  }
  EXPECT_LT(first["substep"], first["frame"]);
  EXPECT_GT(first["substep"], first["frame"] - 4);
}

TEST_F(Program, CheckGivesTheVerdictsThatTheRunGave) {
  for (const std::string name : {"three_cuts", "uniform_stretch_strain"}) {
    const Outcome run = cutproof("run " + scene(name) + " --check --json run.json --record recording");
    const Outcome check = cutproof("check recording --json check.json");
    EXPECT_EQ(run.status, check.status) << check.output;
    const json ran = json::parse(read("run.json")), checked = json::parse(read("check.json"));
    EXPECT_GT(ran["verdicts"].size(), 500u);
    EXPECT_EQ(without_relations(ran["verdicts"]), checked["verdicts"]);
    EXPECT_GT(ran["verdicts"].size(), checked["verdicts"].size());
    EXPECT_TRUE(has_note(ran, "Relations between runs were judged in"));
    EXPECT_TRUE(has_note(checked, "A recording cannot be run"));
    ASSERT_EQ(ran["frames"].size(), checked["frames"].size());
    for (std::size_t f = 0; f < ran["frames"].size(); ++f)
      EXPECT_EQ(ran["frames"][f]["stages"], checked["frames"][f]["stages"]);
  }
}

TEST_F(Program, GivesTheSameFailingVerdictsOnARecording) {
  json wrong = small_block();
  wrong["expect"]["components_at_end"] = 3;
  write("wrong.json", wrong.dump());
  EXPECT_EQ(cutproof("run wrong.json --check --json run.json --record recording").status, 1);
  EXPECT_EQ(cutproof("check recording --json check.json").status, 1);
  EXPECT_EQ(without_relations(json::parse(read("run.json"))["verdicts"]), json::parse(read("check.json"))["verdicts"]);
}

TEST_F(Program, JudgesAsDeepAsItIsAsked) {
  write("cut.json", small_block().dump());
  const auto run = [&](const std::string& arguments) {
    const Outcome outcome = cutproof("run " + arguments + " --json out.json --record recording");
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    return json::parse(read("out.json"));
  };
  const json everything = run("cut.json --check"), named = run("cut.json --check motion"),
             before = run("--check cut.json"), topology = run("cut.json --check topology");
  EXPECT_EQ(everything["verdicts"], named["verdicts"]);
  EXPECT_EQ(everything["verdicts"], before["verdicts"]);
  EXPECT_LT(topology["verdicts"].size(), everything["verdicts"].size());
  EXPECT_EQ(without_relations(topology["verdicts"]), topology["verdicts"]);
  EXPECT_TRUE(has_note(topology, "Only the topology"));
  EXPECT_FALSE(has_note(everything, "Only the topology"));

  EXPECT_EQ(cutproof("check recording --check topology --json checked.json").status, 0);
  EXPECT_TRUE(has_note(json::parse(read("checked.json")), "Only the topology"));
  EXPECT_EQ(json::parse(read("checked.json"))["verdicts"], topology["verdicts"]);

  expect_refused("run cut.json --check everything", {"--check", "everything", "topology or motion"});
  expect_refused("check recording --check everything", {"--check", "everything", "topology or motion"});
}

TEST_F(Program, SaysHowNearToItsBoundEachPropertyCame) {
  write("cut.json", small_block().dump());
  const Outcome outcome = cutproof("run cut.json --check --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  std::map<std::pair<std::string, std::string>, double> nearest;
  for (const json& verdict : document["verdicts"]) {
    if (verdict["bound"] == 0 || verdict["checked"] == 0) continue;
    double& share = nearest[{verdict["property"], verdict["stage"]}];
    share = std::max(share, verdict["measured"].get<double>() / verdict["bound"].get<double>());
  }
  int with_share = 0;
  double greatest = 0;
  std::string which;
  for (const json& property : document["properties"]) {
    if (property["of_bound"].is_null()) continue;
    ++with_share;
    // Beyond its bound disturbed runs are asked: its share says little.
    if (property["of_bound"] > greatest && property["property"] != "admissible step") {
      greatest = property["of_bound"];
      which = property["property"].get<std::string>() + " after " + property["stage"].get<std::string>();
    }
    EXPECT_EQ(property["of_bound"], (nearest[{property["property"], property["stage"]}])) << property;
  }
  EXPECT_GT(with_share, 5);
  std::array<char, 32> share;
  std::snprintf(share.data(), share.size(), "%.2g", greatest);
  const std::string words = "the nearest to its bound: " + which + ", at " + share.data() + " of it.";
  EXPECT_NE(on_one_line(outcome.output).find(words), std::string::npos) << words << "\n" << outcome.output;
  const std::string table = cutproof("run cut.json --check --verbose").output;
  // Of each row the first word, which no column is too narrow for, and the stage, which stands before a number.
  std::multiset<std::pair<std::string, std::string>> wanted, rows;
  for (const json& property : document["properties"]) {
    const std::string name = property["property"];
    wanted.emplace(name.substr(0, name.find(' ')), property["stage"]);
  }
  const std::regex row("\n  (\\S+)[^\n]* (step|detect|split|merge|expand|skin) +[0-9,]+ ");
  for (std::sregex_iterator each(table.begin(), table.end(), row), end; each != end; ++each) {
    rows.emplace(each->str(1), each->str(2));
  }
  // Expectations and what is said of the whole run have rows too.
  EXPECT_TRUE(std::includes(rows.begin(), rows.end(), wanted.begin(), wanted.end())) << table;
  EXPECT_NE(table.find("worst"), std::string::npos) << table;
  EXPECT_EQ(outcome.output.find("worst"), std::string::npos) << "only with --verbose: " << outcome.output;
}

TEST_F(Program, RefusesARecordingThatIsCutOffOrNone) {
  write("cut.json", small_block().dump());
  ASSERT_EQ(cutproof("run cut.json --record recording").status, 0);
  const auto size = files::file_size(path("recording.cutproof.h5"));
  files::resize_file(path("recording.cutproof.h5"), size / 2);
  expect_refused("check recording", {"recording.cutproof.h5", "remedy"});
  write("text.cutproof.h5", "this is no recording");
  expect_refused("check text.cutproof.h5", {"text.cutproof.h5", "remedy"});
  expect_refused("check nothing_there", {"nothing_there", "remedy"});
}

// Whatever has made it: its scene, its setup and its first snapshot belong together.
TEST_F(Program, ChecksRecordingsOfKernelsOfMeshesAndOfRunsThatWereCutShort) {
  write("cut.json", small_block().dump());
  write("box.off",
        "OFF 8 12 0\n0 0 0\n80 0 0\n80 30 0\n0 30 0\n0 0 20\n80 0 20\n80 30 20\n0 30 20\n"
        "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n"
        "3 3 4 7\n");
  for (const std::string& options :
       {std::string("--backend host"), "--backend " + kOfSplit, std::string("--mesh box.off --spacing 0.01"),
        std::string("--frames 3"), std::string("--set detect.every=substep --frames 2")}) {
    ASSERT_EQ(cutproof("run cut.json --record seen " + options).status, 0) << options;
    const Outcome checked = cutproof("check seen --check topology");
    EXPECT_NE(checked.status, 2) << options << "\n" << checked.output;
    EXPECT_EQ(cutproof("digest seen").status, 0) << options;
  }
  EXPECT_EQ(cutproof("run cut.json --record seen --backend host --frames 3").status, 0);
  EXPECT_EQ(cutproof("check seen").status, 0);
  const std::string claim = "cd '" + folder_.string() +
                            "' && /usr/bin/python3 -c \"import h5py; "
                            "h5py.File('seen.cutproof.h5', 'r+').attrs.modify('unit_roundoff', 2.0**-53)\"";
  ASSERT_EQ(std::system(claim.c_str()), 0);
  expect_refused("check seen", {"seen.cutproof.h5", "unit_roundoff", "the backend host has", "remedy"});
  expect_refused("report seen -o page.html", {"unit_roundoff"});
}

// --- Backends that can run some spans only ---------------------------------------------------------------------------

TEST_F(Program, JudgesBackendsOfWholeFramesAndOfOneStageOnWhatTheyRun) {
  write("cut.json", small_block().dump());
  for (const std::string& backend : {kOfWholeFrames, kOfSplit}) {
    const Outcome run = cutproof("run cut.json --check --json out.json --backend " + backend);
    EXPECT_EQ(run.status, 0) << run.output;
    const json document = json::parse(read("out.json"));
    std::set<std::string> judged;
    for (const json& verdict : document["verdicts"]) {
      if (verdict["checked"] > 0) judged.insert(verdict["property"]);
    }
    EXPECT_EQ(judged.contains("linear momentum"), backend == kOfWholeFrames);
    EXPECT_EQ(judged.contains("split exactness"), backend == kOfSplit);
    EXPECT_EQ(judged.contains("stages in one piece"), backend == kOfWholeFrames);
    const Outcome fuzz = cutproof("fuzz --cases 300 --backend " + backend);
    EXPECT_EQ(fuzz.status, 0) << fuzz.output;
  }
  const Outcome against = cutproof("run cut.json --against reference --backend " + kOfWholeFrames);
  EXPECT_EQ(against.status, 2) << against.output;
  EXPECT_NE(against.output.find("--against"), std::string::npos);
}

// Wherever verdicts are shown: as text, JSON, JUnit, annotations, on a page, and of the recording.
TEST_F(Program, SaysWhichStagesTheReferenceRanForTheBackend) {
  write("cut.json", small_block().dump());
  const std::string sentence = "The reference ran step, detect, merge and skin for the backend: not judged.";
  const auto shows = [&](const std::string& command) {
    const std::string page = CUTPROOF_HAS_PAGES != 0 ? " --report out.html" : "";
    const Outcome outcome = cutproof(command + " --json out.json --junit out.xml" + page, "GITHUB_ACTIONS=true");
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(on_one_line(outcome.output).find(sentence), std::string::npos) << outcome.output;
    EXPECT_NE(outcome.output.find("::warning title=cutproof: not judged::the reference ran step, detect, merge, skin"),
              std::string::npos)
        << outcome.output;
    const json left = json::parse(read("out.json")).at("left_to_reference");
    EXPECT_EQ(left.at("stages"), json({"step", "detect", "merge", "skin"}));
    EXPECT_NE(read("out.xml").find("name=\"stage skin\""), std::string::npos);
    EXPECT_TRUE(page.empty() || read("out.html").find(sentence) != std::string::npos);
    return left;
  };
  const json left = shows("run cut.json --check --record cut --backend " + kOfSplit);
  EXPECT_FALSE(left.at("expected").empty());
  EXPECT_EQ(shows("check cut").at("expected"), left.at("expected"));
  const Outcome fuzz = cutproof("fuzz --cases 60 --json out.json --backend " + kOfSplit);
  EXPECT_NE(on_one_line(fuzz.output).find("The reference ran step, detect, merge, expand and skin"), std::string::npos)
      << fuzz.output;
  const Outcome all = cutproof("run cut.json --check --backend host");
  EXPECT_EQ(all.output.find("The reference ran"), std::string::npos) << all.output;
}

TEST_F(Program, FailsAPluginThatRunsNoStage) {
  write("cut.json", small_block().dump());
  const std::string plugin = std::string(" --backend 'plugin:") + CUTPROOF_PLUGIN_THAT_RUNS_NOTHING + "'";
  for (const char* verb :
       {"run cut.json --check --record cut", "run cut.json --against reference", "fuzz --cases 20"}) {
    const Outcome outcome = cutproof(verb + plugin);
    EXPECT_EQ(outcome.status, 1) << verb << outcome.output;
    EXPECT_NE(on_one_line(outcome.output).find("the backend ran no stage"), std::string::npos) << outcome.output;
  }
  EXPECT_EQ(cutproof("check cut").status, 1);
}

TEST_F(Program, RefusesToMeasureErrorsOfStagesThatTheBackendCannotRun) {
  write("cut.json", small_block().dump());
  for (const char* error : {"solver", "time_step", "conservation"}) {
    expect_refused("run cut.json --backend " + kOfSplit + " --errors " + error, {"--errors", error});
  }
  EXPECT_EQ(cutproof("run cut.json --errors topology --backend " + kOfSplit).status, 0);
}

// --- Bad input ------------------------------------------------------------------------------------------------------

TEST_F(Program, SaysWhatToDoNextWhenRunHasNoScene) {
  // Pages of what there is, in place of an error and its remedy.
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"run", {"cutproof run kidney_discontinuous", "--check", "--mesh", "info --scenes"}},
           {"", {"run", "check", "info"}}}) {
    const std::set<std::string> before = listing();
    const Outcome outcome = cutproof(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    for (const std::string& word : words) EXPECT_NE(outcome.output.find(word), std::string::npos) << outcome.output;
    EXPECT_EQ(listing(), before) << "something was written";
  }
}

TEST_F(Program, RefusesWrongUsageWithStatusTwo) {
  write("cut.json", small_block().dump());
  expect_refused("run cut.json --frobnicate", {"--frobnicate"});
  expect_refused("dissect cut.json", {"dissect", "did you mean 'digest'?", "fuzz"});
  expect_refused("run cut.json --backend abacus", {"abacus", "cutproof info"});
  expect_refused("run cut.json --mesh x.stl --unit furlong", {"furlong", "mm"});
  expect_refused("run cut.json --particles 0", {"--particles"});
  expect_refused("run not_there.json", {"not_there.json"});
  expect_refused("run cut.json --json no/such/folder/out.json", {"no/such/folder"});
  expect_refused("run cut.json --record no/such/folder/r", {"no/such/folder"});
  expect_refused("check", {"recording", "required"});
}

TEST_F(Program, RefusesEachBadSceneWithFileFieldAndRemedy) {
  const auto refuse = [this](const std::string& pointer, const json& value, const std::vector<std::string>& words) {
    json scene = small_block();
    scene[json::json_pointer(pointer)] = value;
    write("bad.json", scene.dump());
    std::vector<std::string> all = words;
    all.push_back("bad.json");
    all.push_back("remedy");
    expect_refused("run bad.json --check --json out.json --record r", all);
  };
  refuse("/stpe", json::object(), {"stpe", "step"});
  refuse("/body/spacing", -0.01, {"body.spacing", "-0.01"});
  refuse("/body/spacing", 1e-9, {"body.spacing", "GB"});
  refuse("/body/spacing", "fine", {"body.spacing"});
  refuse("/blade/strokes", json::array(), {"blade.strokes"});
  refuse("/blade/strokes/0/points", json::array(), {"blade.strokes[0].points"});
  refuse("/version", 99, {"version", "99"});
  refuse("/body/particles", 1000, {"body"});
  std::string nan = small_block().dump();
  nan.replace(nan.find("\"speed\":1"), 9, "\"speed\":NaN");
  write("nan.json", nan);
  expect_refused("run nan.json", {"nan.json", "remedy"});
  std::string huge = small_block().dump();
  huge.replace(huge.find("\"speed\":1"), 9, "\"speed\":1e999");
  write("huge.json", huge);
  expect_refused("run huge.json", {"huge.json", "remedy"});
  write("empty.json", "");
  expect_refused("run empty.json", {"empty.json", "remedy"});
}

TEST_F(Program, RefusesEachBadMeshFile) {
  write("cut.json", small_block().dump());
  write("empty.stl", "");
  expect_refused("run cut.json --mesh empty.stl --json out.json", {"empty.stl", "empty", "remedy"});
  write("text.stl", "Dear sir, this is a letter and not a mesh.\n");
  expect_refused("run cut.json --mesh text.stl --json out.json", {"text.stl", "remedy"});
  std::string binary(84, '\0');
  binary[80] = 100;  // promises 100 triangles
  write("short.stl", binary + std::string(120, '\1'));
  expect_refused("run cut.json --mesh short.stl --json out.json", {"short.stl", "100", "remedy"});
  expect_refused("run cut.json --mesh not_there.obj", {"not_there.obj"});
}

TEST_F(Program, PrintsNothingButPlainLinesWhenPiped) {
  write("cut.json", small_block().dump());
  const Outcome outcome = cutproof("run cut.json --check");
  EXPECT_EQ(outcome.output.find('\r'), std::string::npos);
  EXPECT_EQ(outcome.output.find('\x1b'), std::string::npos);
}

TEST_F(Program, TellsItsVersionBackendsAndSceneFields) {
  EXPECT_EQ(cutproof("--version").output, std::string("cutproof ") + CUTPROOF_VERSION + "\n");
  const std::string told = cutproof("info").output;
  EXPECT_NE(told.find("reference"), std::string::npos);
  EXPECT_TRUE(told.ends_with("\n" + cutproof("--version").output)) << told;
  const Outcome scene_fields = cutproof("info --scene");
  EXPECT_EQ(scene_fields.status, 0);
  EXPECT_NE(scene_fields.output.find("blade"), std::string::npos);
  const std::string overview = cutproof("--help").output;
  EXPECT_LE(std::count(overview.begin(), overview.end(), '\n'), 24) << overview;
  for (const char* const example : {"cutproof run three_cuts --check", "cutproof check run.h5", "cutproof judge "})
    EXPECT_NE(overview.find(std::string("\n  ") + example), std::string::npos) << overview;
  EXPECT_EQ(overview.find("\n  report ") != std::string::npos, CUTPROOF_HAS_PAGES != 0) << "a verb that it lacks";
  for (const std::string command : {"--help", "run --help", "check --help", "info --help"}) {
    EXPECT_EQ(cutproof(command).status, 0) << command;
  }
  std::istringstream help(cutproof("run --help").output);
  std::string line, screen;
  for (int k = 0; k < 24 && std::getline(help, line); ++k) screen += line + '\n';
  for (const char* const option : {"\n  --check ", "\n  --report "})
    EXPECT_EQ(screen.find(option) != std::string::npos,
              option != std::string("\n  --report ") || CUTPROOF_HAS_PAGES != 0)
        << screen;
  const std::string relate = cutproof("relate --help").output;
  for (const char* const map : {"same", "reset", "checkpoint",
                                "units:", "mirror:", "rotate:", "shift:", "boost:", "permute", "split", "refine"})
    EXPECT_NE(relate.find(map), std::string::npos) << map;
  const std::size_t begin = relate.rfind('\n', relate.find("mirror:x")) + 1;
  EXPECT_EQ(relate.find_first_not_of(' ', begin) - begin, 30) << "an explanation leaves its column:\n" << relate;
}

TEST_F(Program, ListsEveryPropertyThatARunIsJudgedByWithItsSourceAndWhenItApplies) {
  write("cut.json", small_block().dump());
  ASSERT_EQ(cutproof("run cut.json --check --json out.json").status, 0);
  const std::string printed = cutproof("info").output, listed = on_one_line(printed);
  for (const json& verdict : json::parse(read("out.json")).at("verdicts")) {
    const auto property = verdict.at("property").get<std::string>();
    if (property.starts_with("expected ")) continue;  // by the scene
    EXPECT_NE(printed.find("\n  " + property + " "), std::string::npos) << property;
  }
  for (const char* line :
       {" cluster connectivity method.md §2, I1", " not between detection and split; rests on alive, offsets, members ",
        " motion method.md §3; tolerances.md, Motion", " after step; rests on the whole state ",
        " skin geometry method.md §8, lemma;"}) {
    EXPECT_NE(listed.find(line), std::string::npos) << line << listed;
  }
}

TEST_F(Program, LetsTheRestOfTheKidneyEndWithTheSameBitsWhetherOrNotThePieceIsPulledAway) {
  std::ifstream file(scene("kidney_discontinuous"));
  json pulled = json::parse(file);
  json left = pulled;
  left["grips"].erase(1);
  write("pulled.json", pulled.dump());
  write("left.json", left.dump());
  ASSERT_EQ(cutproof("run pulled.json --record pulled").status, 0);
  ASSERT_EQ(cutproof("run left.json --record left").status, 0);
  const std::string script = std::string("/usr/bin/python3 '") + CUTPROOF_SOURCE + "/tests/cli/same_bits.py' '" +
                             path("pulled") + "' '" + path("left") + "'";
  EXPECT_EQ(std::system(script.c_str()), 0);
}

}  // namespace
}  // namespace program_test
