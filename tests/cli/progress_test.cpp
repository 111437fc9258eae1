#include "cli/progress.h"

#include <gtest/gtest.h>

namespace progress_test {
namespace {

using namespace cutproof::cli;

TEST(Remaining, IsNotForetoldBeforeAnythingIsKnown) {
  Remaining remaining;
  EXPECT_FALSE(remaining.seconds());
  remaining.note(0.5, 0.1);
  EXPECT_FALSE(remaining.seconds()) << "too early";
  remaining.note(5, 0);
  EXPECT_FALSE(remaining.seconds()) << "nothing was done";
}

TEST(Remaining, FollowsFromASteadyPace) {
  Remaining remaining;
  for (int k = 1; k <= 40; ++k) remaining.note(k, k / 100.0);
  ASSERT_TRUE(remaining.seconds());
  EXPECT_NEAR(*remaining.seconds(), 60, 1e-9);
  remaining.note(100, 1);
  EXPECT_EQ(*remaining.seconds(), 0);
}

// A scene whose tissue is cut in its second half takes ten times as long there.
TEST(Remaining, FollowsAPaceThatChanges) {
  Remaining remaining;
  double time = 0;
  for (int k = 1; k <= 50; ++k) remaining.note(time += 0.1, k / 100.0);
  for (int k = 51; k <= 75; ++k) remaining.note(time += 1, k / 100.0);
  EXPECT_NEAR(*remaining.seconds(), 25, 1e-6) << "the whole's mean pace would say 10 s";
}

TEST(Remaining, NeedsNoMoreMemoryTheLongerItTakes) {
  Remaining remaining;
  for (int k = 1; k <= 100'000; ++k) {
    remaining.note(k, k / 200'000.0);
    ASSERT_LE(remaining.marks(), Remaining::kMostMarks) << k;
  }
  EXPECT_NEAR(*remaining.seconds(), 100'000, 1e-6);
}

TEST(Remaining, IsSaidInWords) {
  EXPECT_EQ(in_words(0.2), "1 s");
  EXPECT_EQ(in_words(9), "9 s");
  EXPECT_EQ(in_words(42), "40 s");
  EXPECT_EQ(in_words(59), "1 min");
  EXPECT_EQ(in_words(125), "2 min");
  EXPECT_EQ(in_words(3599), "1 h");
  EXPECT_EQ(in_words(4800), "1 h 20 min");
  EXPECT_EQ(in_words(7200), "2 h");
  EXPECT_EQ(in_words(86400), "24 h");
  EXPECT_EQ(in_words(1e300), "days");
  EXPECT_EQ(elapsed_and_remaining(12, 125), "elapsed 10 s, about 2 min left");
  EXPECT_EQ(elapsed_and_remaining(12, {}), "elapsed 10 s");
  EXPECT_EQ(elapsed_and_remaining(12, 0.4), "elapsed 10 s, nearly done");
}

}  // namespace
}  // namespace progress_test
