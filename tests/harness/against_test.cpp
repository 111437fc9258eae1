// `cutproof run --against reference`.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/program.h"

namespace against_test {
namespace {

class TheProgram : public Program {};
const std::string kScene = "'" CUTPROOF_SOURCE "/fixtures/scenes/small_block.json'";

TEST_F(TheProgram, ComparesTheKernelsWithTheReferenceAndWritesEveryFrame) {
  const Outcome outcome = cutproof("run " + kScene + " --frames 12 --backend host --against reference --json out.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("lockstep"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("what was compared holds"), std::string::npos) << outcome.output;
  const nlohmann::json document = nlohmann::json::parse(read("out.json"));
  const nlohmann::json& against = document["against"];
  EXPECT_EQ(against["mode"], "both");
  EXPECT_EQ(against["holds"], true);
  EXPECT_EQ(against["verdicts"].size(), 10u);
  const std::size_t frames = document["frames"].size();
  EXPECT_EQ(frames, 12u);
  for (const auto& [name, column] : against["lockstep"]["frames"].items()) EXPECT_EQ(column.size(), frames) << name;
  EXPECT_EQ(against["free_running"]["frames"]["position_rms"].size(), frames);
  EXPECT_GT(against["lockstep"]["frames"]["position_max"][5], 0.0);
}

TEST_F(TheProgram, ComparesInOneModeOnlyIfAsked) {
  const Outcome lockstep = cutproof("run " + kScene + " --frames 2 --against reference --mode lockstep");
  EXPECT_EQ(lockstep.status, 0);
  EXPECT_EQ(lockstep.output.find("free-running"), std::string::npos) << lockstep.output;
  const Outcome free_running =
      cutproof("run " + kScene + " --frames 2 --against reference --mode free-running --check --verbose");
  EXPECT_EQ(free_running.output.find("lockstep"), std::string::npos) << free_running.output;
  EXPECT_NE(free_running.output.find("skin surface"), std::string::npos) << "--check works beside it";
}

TEST_F(TheProgram, RefusesToCompareWithAnythingElse) {
  const Outcome outcome = cutproof("run " + kScene + " --against host");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.output.find("there is no comparison with 'host'"), std::string::npos) << outcome.output;
  EXPECT_EQ(cutproof("run " + kScene + " --against reference --mode loose").status, 2);
  EXPECT_EQ(cutproof("run " + kScene + " --mode lockstep").status, 2);
}

}  // namespace
}  // namespace against_test
