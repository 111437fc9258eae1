// `cutproof bench scale`: each size with its time, memory and error. What the times are is not tested.
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "benchmarks/memory.h"
#include "tests/cli/program.h"

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
    ASSERT_EQ(document.at("rows").size(), 2U);
    int64_t before = 0;
    for (const json& row : document.at("rows")) {
      EXPECT_EQ(row.at("backend"), backend);
      EXPECT_GT(row.at("particles_per_second"), 0);
      EXPECT_EQ(row.at("error").at("frame").at("topology_holds"), true);
      EXPECT_TRUE(row.at("error").at("step").is_object());
      if (!cutproof::benchmarks::bytes_in_use(cutproof::harness::described_backend(backend)))
        continue;  // a sanitizer's allocator does not count
      // At the very least position and velocity of each particle in single precision.
      EXPECT_GT(row.at("bytes"), 24 * row.at("particles").get<int64_t>());
      EXPECT_GT(row.at("bytes"), before);
      before = row.at("bytes");
    }
  }
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
  expect_refused("bench scale --split blocks", {"--split"});
  expect_refused("bench scale --json nowhere/out.json", {"nowhere"});
}

}  // namespace
