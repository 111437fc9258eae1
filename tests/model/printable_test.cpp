#include "model/printable.h"

#include <gtest/gtest.h>

#include "model/error.h"

namespace cutproof::printable_test {
namespace {

using namespace std::string_literals;

TEST(Printable, KeepsWhatPeopleRead) {
  const std::string text = "kidney é ² · 𝄞 你好 नमस्ते \\ ' \"";
  EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesWhatActsOnATerminal) {
  EXPECT_EQ(printable("\x1b[2J\x07\x7f\0"s), R"(\x1b[2J\x07\x7f\x00)");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            R"(\u009b31m)");
  EXPECT_EQ(printable("a\n\t\rb"), R"(a\n\t\rb)");
  EXPECT_EQ(printable_lines("a\n\t\rb"), "a\n\t\\rb");
}

TEST(Printable, EscapesWhatTurnsReadingRoundOrIsNotSeen) {
  EXPECT_EQ(printable("\u202e\u2066\u200f\u061c\ufeff\u200b\u2028"), R"(\u202e\u2066\u200f\u061c\ufeff\u200b\u2028)");
  EXPECT_EQ(printable("\U000e0041"), R"(\U000e0041)");
}

TEST(Printable, EscapesBytesThatAreNoUtf8) {
  EXPECT_EQ(printable("caf\xe9.json"), R"(caf\xe9.json)");
  EXPECT_EQ(printable("\xc0\xaf\xed\xa0\x80\xf4\x90\x80\x80\xe2\x82"),
            R"(\xc0\xaf\xed\xa0\x80\xf4\x90\x80\x80\xe2\x82)");
  EXPECT_TRUE(is_utf8("é"));
  EXPECT_FALSE(is_utf8("\xe9"));
}

TEST(Printable, IsPrintableOnceAndForAll) {
  for (int first = 0; first < 256; ++first) {
    for (int second = 0; second < 256; ++second) {
      const std::string text = {static_cast<char>(first), static_cast<char>(second), 'x'};
      const std::string once = printable(text);
      ASSERT_EQ(printable(once), once) << first << " " << second;
      ASSERT_TRUE(is_utf8(once));
    }
  }
}

TEST(Shortened, CutsBetweenCharactersAndSaysHowMuchIsLeftOut) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcdef", 3), "abc ... (3 more bytes)");
  EXPECT_EQ(shortened("abcd", 3), "abc ... (1 more byte)");
  EXPECT_EQ(shortened("abé", 3), "ab ... (2 more bytes)");
}

TEST(AnInputError, HasTwoLinesWhateverItQuotes) {
  const InputError error("a\nb", std::string(1000, 'f'), "is \"\x1b\n  remedy: none\"", "Mend it.");
  const std::string text = error.what();
  EXPECT_EQ(text.substr(0, 6), "a\\nb: ");
  EXPECT_NE(text.find("(700 more bytes): is \"\\x1b\\n  remedy: none\"\n  remedy: Mend it."), std::string::npos)
      << text;
  EXPECT_EQ(error.file(), "a\nb");
}

}  // namespace
}  // namespace cutproof::printable_test
