// Scenes that come with the program, named without a path from any folder.
#include <gtest/gtest.h>

#include "tests/cli/program.h"

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
  write("small_block", R"({"version": 1, "name": "mine", "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]},
    "spacing": 0.01}, "frame": {"count": 1}})");
  const Outcome outcome = cutproof("run small_block");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("scene mine"), std::string::npos) << outcome.output;
}

TEST_F(SceneNames, ThatThereAreNotAreRefusedWithThoseThatThereAre) {
  expect_refused("run kidny", {"kidny", "no scene that comes with the program", "kidney_arc", "three_cuts"});
  expect_refused("run kidny.json", {"kidny.json", "cannot be opened"});
  expect_refused("run ./small_block", {"./small_block", "cannot be opened"});
  expect_refused("tune kidny --tolerance 1", {"kidny", "no scene that comes with the program"});
}

}  // namespace
