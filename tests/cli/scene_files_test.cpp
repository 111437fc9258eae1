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
  expect_refused("run kidny", {"kidny", "no scene that comes with the program", "kidney_arc", "three_cuts"});
  expect_refused("run kidny.json", {"kidny.json", "no such file"});
  expect_refused("run ./small_block", {"./small_block", "no such file"});
  expect_refused("tune kidny --tolerance 1", {"kidny", "no scene that comes with the program"});
}

// What the guide says of scenes: a body that nothing holds is pushed away, one that is held is cut, and a geometric cut
// does not ask.
TEST_F(SceneNames, OfYourOwnNeedABodyThatIsHeldOrAGeometricCut) {
  const std::string held =
      R"("grips": [{"low": [0, 0, 0], "high": [0.15, 1, 1]}, {"low": [0.85, 0, 0], "high": [1, 1, 1]}],)";
  const std::string geometric = R"("detect": {"criterion": "geometric"},)";
  constexpr int kLayer = 8 * 8;  // of the block's 20 x 8 x 8 particles
  std::ifstream page(CUTPROOF_SOURCE "/docs/guide.md");
  const std::string guide((std::istreambuf_iterator<char>(page)), {});
  // What the guide says after each speed of a block that nothing holds, with the number that was counted here.
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
      EXPECT_NE(guide.find(said.first + number + said.second), std::string::npos)
          << "the guide does not say '" << said.first << number << said.second << "'";
    }
  }
}

}  // namespace
}  // namespace scene_files_test
