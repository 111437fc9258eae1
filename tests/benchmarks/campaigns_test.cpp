// `cutproof bench campaigns`: each campaign with its rate, its shares and what it compared. What these are is not
// tested.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "benchmarks/suites/suites.h"
#include "tests/program.h"

namespace campaigns_test {
namespace {

using nlohmann::json;

class BenchCampaigns : public Program {};

TEST_F(BenchCampaigns, TellsRateSharesAndComparisonsOfEachBesideTheReferences) {
  const Outcome outcome = cutproof("bench campaigns --backend host --cases 12 --threads 2 --batch 3 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  EXPECT_FALSE(document.at("processor").get<std::string>().empty());
  ASSERT_EQ(document.at("rows").size(), 6U);
  for (std::size_t k = 0; k < 6; ++k) {
    const json& row = document.at("rows")[k];
    EXPECT_EQ(row.at("campaign"), (std::array{"small", "large", "moving"}[k / 2]));
    EXPECT_EQ(row.at("backend"), k % 2 == 0 ? "reference" : "host");
    EXPECT_EQ(row.at("cases"), 12);
    EXPECT_EQ(row.at("threads"), 2);
    EXPECT_EQ(row.at("batch"), 3);
    EXPECT_EQ(row.at("devices").size(), 1U);
    EXPECT_GT(row.at("mean_particles"), 0);
    EXPECT_GT(row.at("cases_per_second"), 0);
    const json& parts = row.at("thread_seconds");
    EXPECT_EQ(parts.size(), 5U);
    for (const char* const part : {"generating", "simulating", "judging"}) EXPECT_GT(parts.at(part), 0) << part;
    const bool is_compared = k % 2 != 0;
    EXPECT_EQ(parts.at("reference") > 0, is_compared);
    EXPECT_EQ(row.at("of_reference").is_null(), !is_compared);
    const json& error = row.at("error");
    EXPECT_GT(error.at("verdicts"), 12);
    EXPECT_GT(error.at("checked"), error.at("inconclusive").get<int64_t>());
    EXPECT_EQ(error.at("violations"), 0);
    EXPECT_EQ(error.at("positions").is_null(), k != 5);
    EXPECT_EQ(error.at("greatest_h").is_null(), k != 5);
  }
  EXPECT_GT(document.at("rows")[5].at("error").at("positions"), 100);
  EXPECT_NE(outcome.output.find("small, host: "), std::string::npos) << outcome.output;

  // The campaign is the one that `fuzz` runs.
  ASSERT_EQ(cutproof("fuzz --backend host --dynamics --cases 12 --batch 3 --json fuzz.json").status, 0);
  const json fuzzed = json::parse(read("fuzz.json"));
  EXPECT_EQ(document.at("rows")[5].at("error").at("verdicts"), fuzzed.at("verdicts"));
  EXPECT_EQ(document.at("rows")[5].at("error").at("positions"), fuzzed.at("steps_compared").at("particles"));
}

TEST_F(BenchCampaigns, HasOneRowOfTheReferenceByItself) {
  const Outcome outcome = cutproof("bench campaigns --kinds moving --cases 5 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json rows = json::parse(read("out.json")).at("rows");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].at("backend"), "reference");
  EXPECT_TRUE(rows[0].at("of_reference").is_null());
}

TEST_F(BenchCampaigns, RefusesBadUsage) {
  expect_refused("bench campaigns --kinds tiny", {"--kinds", "tiny", "small, large, moving"});
  expect_refused("bench campaigns --backend simulated", {"--backend", "simulated", "host"});
  expect_refused("bench campaigns --devices 0", {"--devices", "reference", "no device", "gpu"});
  expect_refused("bench campaigns --seconds -1", {"--seconds"});
}

}  // namespace
}  // namespace campaigns_test
