#include "model/io/columns.h"

#include <gtest/gtest.h>

namespace columns_test {
namespace {

using namespace cutproof::io;

TEST(Columns, AreCountedAsATerminalDoes) {
  EXPECT_EQ(width_of("111 × 58 mm, …"), 14u);
  EXPECT_EQ(width_of("\x1b[31mFAILS\x1b[0m"), 5u) << "colours take none";
  EXPECT_EQ(width_of("肝臓"), 4u) << "wide characters take two";
  EXPECT_EQ(width_of("e\xcc\x81"), 1u) << "a mark stands on its letter";
  EXPECT_EQ(width_of("\xff\xc3("), 9u) << "bytes that are no UTF-8 are printed as \\xff";
  EXPECT_EQ(width_of("a\x07"), 5u) << "and what would act on a terminal as \\x07";
}

TEST(Columns, BreakLinesAtWordsAndStandFurtherIn) {
  EXPECT_EQ(wrapped_text("  one two three four\n", 12), "  one two\n    three\n    four\n");
  EXPECT_EQ(wrapped_text("a\n\nb", 12), "a\n\nb");
  EXPECT_EQ(wrapped_text("××× ××× ×××", 7), "××× ×××\n  ×××") << "columns, not bytes";
  EXPECT_EQ(hanging("name  one two three", 6, 14), "name  one two\n      three");
}

TEST(Columns, LeaveAPathWholeAndCutOtherLongWords) {
  EXPECT_EQ(wrapped_text("wrote /a/very/long/path here\n", 12), "wrote\n  /a/very/long/path\n  here\n");
  EXPECT_EQ(wrapped_text("abcdefghijklmnopq\n", 8), "abcdefgh\n  ijklmn\n  opq\n");
}

TEST(Columns, CutATextWithoutCuttingACharacter) {
  EXPECT_EQ(cut_to("a×b", 2), "a×");
  EXPECT_EQ(cut_to("a肝", 2), "a");
  EXPECT_EQ(cut_to("\x1b[31mab\x1b[0m", 1), "\x1b[31ma");
}

TEST(Columns, CutALineWhereAWordEnds) {
  const std::string line = "frame 3 of 20, about 2 min left: 36 clusters";
  EXPECT_EQ(cut_to_words(line, 44), line);
  EXPECT_EQ(cut_to_words(line, 43), "frame 3 of 20") << "a figure is not parted from its unit";
  EXPECT_EQ(cut_to_words(line, 14), "frame 3 of 20");
  EXPECT_EQ(cut_to_words(line, 13), "frame 3 of 20") << "a comma is no part of a word";
  EXPECT_EQ(cut_to_words(line, 12), "frame 3 of");
  EXPECT_EQ(cut_to_words(line, 4), "");
}

TEST(Columns, GroupDigits) {
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(16204), "16,204");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(-1234), "-1,234");
  EXPECT_EQ(grouped(-123), "-123");
}

}  // namespace
}  // namespace columns_test
