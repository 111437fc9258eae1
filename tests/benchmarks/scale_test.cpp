// `cutproof bench scale`: each size with its time, memory and error. What the times are is not tested.
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "benchmarks/memory.h"
#include "benchmarks/suites/suites.h"
#include "model/error.h"
#include "tests/program.h"

namespace scale_test {
namespace {

using nlohmann::json;

class BenchScale : public Program {};

TEST_F(BenchScale, TellsTimeMemoryAndErrorOfEachSize) {
  for (const std::string backend : {"reference", "host"}) {
    const Outcome outcome =
        cutproof("bench scale --backend " + backend + " --sizes 1000,3000 --frames 2 --repeats 2 --json out.json");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("complete"), true);
    EXPECT_EQ(document.at("holds"), true);
    ASSERT_EQ(document.at("rows").size(), 4U);
    int64_t before = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const json& row = document.at("rows")[k];
      EXPECT_EQ(row.at("acceleration"), k % 2 == 0 ? "none" : "chebyshev");
      EXPECT_EQ(row.at("iterations"), 4);
      EXPECT_EQ(row.at("backend"), backend);
      EXPECT_GT(row.at("particles_per_second"), 0);
      EXPECT_EQ(row.at("error").at("frame").at("topology_holds"), true);
      EXPECT_TRUE(row.at("error").at("step").is_object());
      if (!cutproof::benchmarks::bytes_in_use(cutproof::harness::described_backend(backend)))
        continue;  // a sanitizer's allocator does not count
      // At the very least position and velocity of each particle in single precision.
      EXPECT_GT(row.at("bytes"), 24 * row.at("particles").get<int64_t>());
      if (k % 2 != 0) continue;  // of the same size as the row before
      EXPECT_GT(row.at("bytes"), before);
      before = row.at("bytes");
    }
  }
}

TEST_F(BenchScale, IteratesAsAskedFor) {
  const Outcome outcome = cutproof(
      "bench scale --sizes 1000 --frames 1 --repeats 1 --acceleration chebyshev --iterations 16 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json rows = json::parse(read("out.json")).at("rows");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].at("acceleration"), "chebyshev");
  EXPECT_EQ(rows[0].at("iterations"), 16);
  EXPECT_NE(outcome.output.find("4 × 16"), std::string::npos) << outcome.output;
}

TEST_F(BenchScale, RemovesTheEndsThatAreAskedFor) {
  std::vector<std::string> ends;
  for (const char* remove : {"", " --remove both", " --remove one"}) {
    const Outcome outcome = cutproof(
        std::string("bench scale --sizes 1000 --frames 12 --repeats 1 --acceleration none --json out.json") + remove);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const json row = json::parse(read("out.json")).at("rows").at(0);
    EXPECT_EQ(row.at("error").at("frame").at("topology_holds"), true);
    ends.push_back(row.at("remove"));
  }
  EXPECT_EQ(ends, (std::vector<std::string>{"both", "both", "one"}));
}

TEST(Scale, RemovesOneEndByTheCriterionOfEdgesOnly) {
  cutproof::benchmarks::ScaleOptions options;
  cutproof::DetectParameters detect;
  options.remove = "one";
  EXPECT_EQ(cutproof::benchmarks::detection_of(options, detect).remove, cutproof::RemovedEnds::one);
  detect.criterion = cutproof::Criterion::geometric;
  EXPECT_THROW(static_cast<void>(cutproof::benchmarks::detection_of(options, detect)), cutproof::InputError);
  options.remove = "both";
  EXPECT_EQ(cutproof::benchmarks::detection_of(options, detect), detect);
}

TEST(Scale, ShowsTimesBeforeTheyAreJudged) {
  cutproof::benchmarks::ScaleOptions options;
  options.sizes = {1000};
  options.acceleration = {"none"};
  options.frames = 2;
  options.repeats = 1;
  std::vector<json> shown;
  static_cast<void>(cutproof::benchmarks::run_scale(options, [&](const json& so_far) { shown.push_back(so_far); }));
  ASSERT_EQ(shown.size(), 3U);
  EXPECT_EQ(shown[1].at("judging"), true);
  EXPECT_FALSE(shown[2].contains("judging"));
  const json &timed = shown[1].at("rows").at(0), &judged = shown[2].at("rows").at(0);
  EXPECT_EQ(timed.at("seconds"), judged.at("seconds"));
  EXPECT_TRUE(timed.at("error").at("frame").is_null());
  EXPECT_EQ(judged.at("error").at("frame").at("topology_holds"), true);
}

TEST(BytesInUse, CountWhatIsAllocated) {
  const auto before = cutproof::benchmarks::bytes_in_use(cutproof::harness::reference_backend());
  if (!before) GTEST_SKIP() << "this allocator does not count";
  constexpr int64_t kSmall = 4096, kLarge = int64_t{64} << 20;  // the large one comes from the system by itself
  const auto small = std::make_unique<char[]>(kSmall), large = std::make_unique<char[]>(kLarge);
  const int64_t found = *cutproof::benchmarks::bytes_in_use(cutproof::harness::reference_backend()) - *before;
  EXPECT_GE(found, kSmall + kLarge);
  EXPECT_LE(found, kSmall + kLarge + 65536);
}

TEST_F(BenchScale, RefusesBadUsage) {
  expect_refused("bench scale --sizes 5", {"--sizes"});
  expect_refused("bench scale --acceleration swift", {"--acceleration", "swift", "none and chebyshev"});
  expect_refused("bench scale --iterations 0", {"--iterations"});
  expect_refused("bench scale --remove none", {"--remove", "none", "both, one"});
  expect_refused("bench scale --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace scale_test
