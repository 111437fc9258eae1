// `cutproof bench machine_limits`: what is timed has to have happened. What the times are is not tested.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "harness/backends.h"
#include "tests/program.h"

namespace machine_limits_test {
namespace {

using nlohmann::json;

class BenchMachineLimits : public Program {};

TEST_F(BenchMachineLimits, HasEveryLimitWithWhatWasLost) {
  for (const std::string backend : {"reference", "host"}) {
    const Outcome outcome = cutproof("bench machine_limits --repeats 3 --json out.json --backend " + backend);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("suite"), "machine_limits");
    EXPECT_EQ(document.at("backend"), backend);
    EXPECT_EQ(document.at("repeats"), 3);
    EXPECT_TRUE(document.at("complete"));
    EXPECT_TRUE(document.at("holds"));
    std::set<std::string> seen, wanted = {"copy, 1 thread"};
    for (const json& row : document.at("rows")) {
      const auto what = row.at("what").get<std::string>();
      seen.insert(what);
      EXPECT_EQ(row.at("lost"), 0) << row;
      EXPECT_GT(row.at("seconds").at("min"), 0) << row;
      EXPECT_LE(row.at("seconds").at("median"), row.at("seconds").at("max")) << row;
      EXPECT_EQ(row.contains("bytes_per_second"), what.rfind("copy", 0) == 0) << row;
      EXPECT_NE(outcome.output.find(what), std::string::npos) << outcome.output;
    }
    if (backend == "host") {
      wanted.insert({"launch of 1 block", "launch of 64 blocks"});
      if (const int threads = cutproof::harness::cpu_threads(); threads > 1) {
        wanted.insert("copy, " + std::to_string(threads) + " threads");
      }
    }
    EXPECT_EQ(seen, wanted);
  }
}

TEST_F(BenchMachineLimits, RefusesBadUsage) {
  expect_refused("bench machine_limits --backend nobody", {"nobody"});
  expect_refused("bench machine_limits --backend gpu-eager", {"finding faults"});
  expect_refused("bench machine_limits --repeats 0", {"repeats"});
  expect_refused("bench machine_limits --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace machine_limits_test
