// `cutproof bench sampling`: Tables 2 and 3 in their structure, each row with its error. What the times are is not
// tested.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "benchmarks/paper.h"
#include "report/paper_comparison.h"
#include "tests/program.h"

namespace sampling_test {
namespace {

using nlohmann::json;

class BenchSampling : public Program {};

TEST_F(BenchSampling, HasARowForEachOfTables2And3WithThePapersFigures) {
  const Outcome outcome = cutproof("bench sampling --frames 2 --repeats 2 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_EQ(document.at("suite"), "sampling");
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  const auto& table_2 = cutproof::benchmarks::paper_samplings();
  ASSERT_EQ(document.at("rows").size(), table_2.size());
  for (std::size_t k = 0; k < table_2.size(); ++k) {
    const json& row = document.at("rows")[k];
    EXPECT_EQ(row.at("paper").at("particles"), table_2[k].particles);
    EXPECT_EQ(row.at("paper").at("clusters"), table_2[k].clusters ? json(*table_2[k].clusters) : json(nullptr));
    EXPECT_EQ(row.at("frame_to_first").is_null(), !table_2[k].clusters) << "ratios are those of Table 2";
    const double wanted = static_cast<double>(table_2[k].particles) / document.at("scaled_down").get<double>();
    EXPECT_LE(std::abs(row.at("particles").get<double>() - wanted), 0.02 * wanted + 1);
    for (const char* what : {"frame", "step", "detect", "split", "merge", "skin"}) {
      EXPECT_TRUE(row.at("seconds").at(what).is_object()) << what << " in " << row;
      EXPECT_TRUE(row.at("error").at(what).is_object()) << what << " in " << row;
    }
    EXPECT_EQ(row.at("error").at("step").at("max_h"), 0) << "the reference against itself";
    EXPECT_EQ(row.at("error").at("frame").at("topology_holds"), true);
    EXPECT_NE(outcome.output.find(row.at("scene").get<std::string>()), std::string::npos) << outcome.output;
  }
}

// Every size of Table 3 is measured, and its times are those that the page of Table 3 has.
TEST_F(BenchSampling, TakesEverySizeOfTable3) {
  const auto& samplings = cutproof::benchmarks::paper_samplings();
  for (const cutproof::report::ComparedSize& size : cutproof::report::kComparedSizes) {
    const auto found = std::find_if(samplings.begin(), samplings.end(),
                                    [&](const auto& one) { return one.particles == size.particles; });
    ASSERT_NE(found, samplings.end()) << size.particles;
    EXPECT_NEAR(found->frame_ms, size.frame_ms.back(), 0.0501) << size.particles << ": Table 3 has one digit less";
  }
}

TEST_F(BenchSampling, RefusesBadUsage) {
  expect_refused("bench sampling --clusters spheres", {"spheres", "boxes, sampled"});
  expect_refused("bench sampling --backend simulated", {"simulated"});
  expect_refused("bench sampling --frames 5000", {"--frames", "at most"});
  expect_refused("bench sampling --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace sampling_test
