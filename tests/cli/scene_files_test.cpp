// Scenes that come with the program, named without a path from any folder.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "tests/program.h"

namespace scene_files_test {
namespace {

class SceneNames : public Program {};

TEST_F(SceneNames, AreListedWithWhatTheScenesShow) {
  const Outcome outcome = cutproof("info --scenes");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  for (const auto& entry : files::directory_iterator(files::path(CUTPROOF_SOURCE) / "fixtures/scenes")) {
    if (entry.path().extension() != ".json") continue;
    EXPECT_NE(outcome.output.find(entry.path().stem().string() + "\n"), std::string::npos) << entry.path();
  }
  EXPECT_NE(outcome.output.find("cut from above"), std::string::npos) << "no descriptions";
}

TEST_F(SceneNames, StandForTheirFiles) {
  const Outcome by_name = cutproof("run small_block --frames 1 --json by_name.json");
  const Outcome by_file = cutproof("run '" + scene("small_block") + "' --frames 1 --json by_file.json");
  EXPECT_EQ(by_name.status, 0) << by_name.output;
  EXPECT_EQ(by_file.status, 0) << by_file.output;
  EXPECT_NE(read("by_name.json").find("\"scene\": \"small_block\""), std::string::npos);
  const Outcome tuned = cutproof("tune small_block --tolerance 1 --reference substeps --repeats 1 --frames 1");
  EXPECT_NE(tuned.status, 2) << tuned.output;
}

// A file here is meant before a scene of the same name that comes with the program.
TEST_F(SceneNames, GiveWayToFiles) {
  write("small_block", R"({"version": 5, "name": "mine", "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]},
    "spacing": 0.01}, "frame": {"count": 1}})");
  const Outcome outcome = cutproof("run small_block");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("scene mine"), std::string::npos) << outcome.output;
}

TEST_F(SceneNames, ThatThereAreNotAreRefusedWithThoseThatThereAre) {
  expect_refused("run kidny", {"kidny", "no included scene of this name", "kidney_arc", "three_cuts"});
  expect_refused("run kidny.json", {"kidny.json", "no such file"});
  expect_refused("run ./small_block", {"./small_block", "no such file"});
  expect_refused("tune kidny --tolerance 1", {"kidny", "no included scene of this name"});
}

// What the page of runs says of scenes: a body that nothing holds is pushed away, one that is held is cut, and a
// geometric cut does not ask.
TEST_F(SceneNames, OfYourOwnNeedABodyThatIsHeldOrAGeometricCut) {
  const std::string held =
      R"("grips": [{"low": [0, 0, 0], "high": [0.15, 1, 1]}, {"low": [0.85, 0, 0], "high": [1, 1, 1]}],)";
  const std::string geometric = R"("detect": {"criterion": "geometric"},)";
  constexpr int kLayer = 8 * 8;  // of the block's 20 x 8 x 8 particles
  std::ifstream page(CUTPROOF_SOURCE "/docs/how_to/judge_a_run.md");
  const std::string text((std::istreambuf_iterator<char>(page)), {});
  // What it says after each speed of a block that nothing holds, with the number that was counted here.
  for (const auto& [speed, components_of_free, said] :
       {std::tuple("0.05", 1, std::pair<std::string, std::string>("at 0.05 m/s (", " particles are lost)")),
        std::tuple("0.15", 1, std::pair<std::string, std::string>("at 0.15 m/s (", ")")),
        std::tuple("1", 2, std::pair<std::string, std::string>("falls in two only at 1 m/s (", ")"))}) {
    for (const std::string& more : {std::string(), held, geometric}) {
      write("block.json", R"({"version": 5, "name": "block", )" + more + R"(
        "body": {"shape": {"kind": "box", "size": [0.1, 0.04, 0.04]}, "spacing": 0.005},
        "frame": {"length": 0.016, "settle": 0.1}, "step": {"stiffness": 100000, "damping": 2},
        "blade": {"thickness": 0.5, "speed": )" +
                              speed + R"(, "strokes": [
          {"points": [[0.5, 0.5, 1.1], [0.5, 0.5, -0.15]], "back": [0, 0, 1], "along": [0, 1, 0]}]}})");
      const Outcome outcome = cutproof("run block.json --errors topology --json block.run.json");
      ASSERT_EQ(outcome.status, 0) << outcome.output;
      const nlohmann::json document = nlohmann::json::parse(read("block.run.json"));
      int removed = 0;
      for (const nlohmann::json& frame : document.at("frames")) removed += frame.at("removed").get<int>();
      const int components = document.at("errors").at("topology").at("components");
      const std::string where = std::string(speed) + " m/s, " + more;
      EXPECT_EQ(components, more.empty() ? components_of_free : 2) << where;
      if (components == 2) {
        EXPECT_EQ(removed, more == geometric ? 2 * kLayer : kLayer) << where;
      } else {
        EXPECT_LT(removed, kLayer) << where;
      }
      if (!more.empty()) continue;
      const std::string number = std::to_string(removed);
      EXPECT_NE(text.find(said.first + number + said.second), std::string::npos)
          << "the page does not say '" << said.first << number << said.second << "'";
    }
  }
}

class Preview : public Program {};

TEST_F(Preview, ShowsASceneAndRunsNothing) {
  if (!CUTPROOF_HAS_PAGES) {
    expect_refused("run cylinder --preview page.html", {"--preview", "built without report pages"});
    return;
  }
  const Outcome outcome = cutproof("run cylinder --preview page.html");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("page.html"), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.output.find("ms per frame"), std::string::npos) << outcome.output;
  EXPECT_EQ(listing(), std::set<std::string>{"page.html"});
  const auto data_of = [&] {
    const std::string page = read("page.html"), begin = "id=\"data\">";
    const std::size_t data = page.find(begin) + begin.size();
    return nlohmann::json::parse(page.substr(data, page.find("</script>", data) - data));
  };
  const nlohmann::json shown = data_of(), &moments = shown.at("moments");
  EXPECT_EQ(shown.at("command"), "preview");
  EXPECT_TRUE(moments.at(0).at("start").get<bool>());
  // After the start, frames in which the blade is down.
  int64_t before = -1;
  for (std::size_t k = 1; k < moments.size(); ++k) {
    EXPECT_FALSE(moments[k].at("blade").is_null());
    EXPECT_GT(moments[k].at("frame").get<int64_t>(), before);
    before = moments[k].at("frame").get<int64_t>();
    EXPECT_EQ(moments[k].at("particles"), moments[0].at("particles"));
  }
  EXPECT_LT(moments.back().at("blade").at(0).at(2).get<double>(), 0) << "the stroke ends below the body";
  EXPECT_EQ(cutproof("run cylinder --set blade.speed=0.01 --preview page.html").status, 0);
  EXPECT_EQ(data_of().at("moments").size(), 61U) << "of a long stroke 60 frames";
  // What looks wrong of the scene is said here.
  const Outcome bent = cutproof("run kidney_arc --set blade.length=1.5 --preview page.html");
  EXPECT_EQ(bent.status, 0) << bent.output;
  EXPECT_NE(on_one_line(bent.output).find("note: blade.length: the blade is a straight plate"), std::string::npos)
      << bent.output;
}

TEST_F(Preview, IsRefusedBesideWhatARunIsFor) {
  if (!CUTPROOF_HAS_PAGES) GTEST_SKIP() << "this program makes no pages";
  for (const std::string other : {"--check", "--against reference", "--errors all", "--record r", "--json r.json",
                                  "--junit r.xml", "--report r.html"}) {
    expect_refused("run cylinder --preview page.html " + other,
                   {"--preview", "nothing runs", other.substr(0, other.find(' '))});
  }
  expect_refused("run cylinder --preview nowhere/page.html", {"nowhere"});
  expect_refused("run cylinder --set blade.length=-1 --preview page.html", {"blade.length"});
}

// What the page of runs says of a straight plate on a bent path: of the length that the note tells it leaves no crumbs.
TEST_F(SceneNames, OfABladeThatLeavesItsPathLeaveCrumbsUnlessItIsShortEnough) {
  write("arc.json", R"({"version": 5, "name": "arc",
    "body": {"shape": {"kind": "cylinder", "radius": 0.03, "length": 0.08}, "particles": 3000},
    "frame": {"settle": 0.08}, "step": {"damping": 5},
    "grips": [{"low": [0, 0, 0], "high": [1, 0.12, 1]}, {"low": [0, 0.88, 0], "high": [1, 1, 1]}],
    "blade": {"thickness": 0.5, "strokes": [
      {"curve": "arc", "points": [[-0.2, 0.3, -0.2], [0.5, 0.65, -0.2], [1.2, 0.3, -0.2]]}]}})");
  const auto pieces = [&](const std::string& more, std::string* note) {
    const Outcome outcome = cutproof("run arc.json --errors topology --json out.json " + more);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    *note = on_one_line(outcome.output);
    return nlohmann::json::parse(read("out.json")).at("errors").at("topology").at("components").get<int>();
  };
  std::string note;
  EXPECT_GT(pieces("", &note), 2);
  const std::size_t told = note.find("--set blade.length=");
  ASSERT_NE(told, std::string::npos) << note;
  EXPECT_EQ(pieces(note.substr(told, note.find(')', told) - told), &note), 2);
  EXPECT_EQ(note.find("beside its path"), std::string::npos) << note;
}

}  // namespace
}  // namespace scene_files_test
