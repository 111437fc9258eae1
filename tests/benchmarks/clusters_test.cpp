// `cutproof bench clusters`: Fig. 10 in its structure, judged after every frame.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/program.h"

namespace clusters_test {
namespace {

using nlohmann::json;

class BenchClusters : public Program {};

TEST_F(BenchClusters, FollowsTheNumberOfClustersForEveryTauAndWithoutMerging) {
  const Outcome outcome = cutproof("bench clusters --particles 2000 --tau 0.25,0.75 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  ASSERT_EQ(document.at("rows").size(), 3U);
  const json& unmerged = document.at("rows").back();
  EXPECT_TRUE(unmerged.at("tau").is_null());
  for (const json& row : document.at("rows")) {
    const auto clusters = row.at("clusters").get<std::vector<int64_t>>();
    const auto frames = row.at("scene_frame").get<std::vector<int64_t>>();
    ASSERT_EQ(clusters.size(), frames.size());
    EXPECT_EQ(frames.back(), 96);
    EXPECT_GT(row.at("removed"), 0);
    EXPECT_EQ(row.at("growth"), static_cast<double>(clusters.back()) / static_cast<double>(clusters.front()) - 1);
    // Four oracles after every frame.
    EXPECT_EQ(row.at("error").at("verdicts"), 5 * (clusters.size() - 1));
    EXPECT_TRUE(row.at("error").at("failed").empty());
    EXPECT_LE(row.at("growth"), unmerged.at("growth")) << "merging is what keeps clusters few";
  }
  // The blade arrives in frame 35; without merging, what it splits stays split.
  EXPECT_GT(unmerged.at("growth"), 0);
  EXPECT_EQ(unmerged.at("clusters")[30], unmerged.at("clusters")[0]);
  for (const char* words : {"τ = 0.25", "no merging", "paper", "+1.0", "growth at the end [%]"}) {
    EXPECT_NE(outcome.output.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
}

TEST_F(BenchClusters, RefusesBadUsage) {
  expect_refused("bench clusters --tau 0", {"--tau"});
  expect_refused("bench clusters --particles 3", {"--particles"});
  expect_refused("bench clusters --backend nobody", {"nobody"});
  expect_refused("bench clusters --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace clusters_test
