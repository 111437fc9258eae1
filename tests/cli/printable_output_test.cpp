// The way to standard output, in processes of their own: it cannot be gone back.
#include "cli/printable_output.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <functional>
#include <string>

namespace cutproof::cli::printable_output_test {
namespace {

std::string printed(const std::function<void()>& print) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    make_output_printable();
    print();
    std::fflush(stdout);
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> block;
  for (ssize_t n; (n = read(ends[0], block.data(), block.size())) > 0;) {
    text.append(block.data(), static_cast<std::size_t>(n));
  }
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return text;
}

void say(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }

TEST(PrintableOutput, LetsThroughWhatPeopleRead) {
  const std::string text = "a table\twith é ² 𝄞\nand more\n";
  EXPECT_EQ(printed([&] { say(text); }), text);
}

TEST(PrintableOutput, EscapesTheRest) {
  EXPECT_EQ(printed([] { say("\x1b[31mred\x07 caf\xe9\r\xe2\x80\xae\n"); }), "\\x1b[31mred\\x07 caf\\xe9\\r\\u202e\n");
}

TEST(PrintableOutput, KnowsCharactersThatAreWrittenInPieces) {
  for (const std::string text : {"é\n", "𝄞\n", "a\xe2\x82z\n", "\xe2\x80\xae\n", "\x1b[31mx\x1b[0m\n"}) {
    const std::string whole = printed([&] { say(text); });
    EXPECT_EQ(printed([&] {
                for (const char c : text) {
                  std::fputc(c, stdout);
                  std::fflush(stdout);
                }
              }),
              whole);
  }
}

TEST(PrintableOutput, LetsColoursThroughIfAskedTo) {
  const auto coloured = [](const std::string& text) {
    const std::string whole = printed([&] {
      let_colours_through();
      say(text);
    });
    EXPECT_EQ(printed([&] {
                let_colours_through();
                for (const char c : text) {
                  std::fputc(c, stdout);
                  std::fflush(stdout);
                }
              }),
              whole);
    return whole;
  };
  EXPECT_EQ(coloured("\x1b[1;31mred\x1b[0m\n"), "\x1b[1;31mred\x1b[0m\n");
  EXPECT_EQ(coloured("\x1b[2J\x1b]0;owned\x07\x1b[31\n"), "\\x1b[2J\\x1b]0;owned\\x07\\x1b[31\n");
  EXPECT_EQ(coloured("\x1b[1111111111111111111111111m\n"), "\\x1b[1111111111111111111111111m\n");
  EXPECT_EQ(coloured("\x1b[8mhidden\n"), "\\x1b[8mhidden\n");
}

TEST(PrintableOutput, IsFastEnoughForLongTexts) {
  const std::string line = std::string(999, 'x') + "\n";
  EXPECT_EQ(printed([&] {
              for (int k = 0; k < 10'000; ++k) say(line);
            }).size(),
            10'000'000u);
}

TEST(PrintableOutput, SaysThatItCannotBeWritten) {
  EXPECT_EXIT(
      {
        dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO);
        make_output_printable();
        say("text\n");
        errno = 0;
        const bool failed = std::fflush(stdout) != 0 && errno == ENOSPC && std::ferror(stdout) != 0;
        _exit(failed ? 7 : 1);
      },
      testing::ExitedWithCode(7), "");
}

}  // namespace
}  // namespace cutproof::cli::printable_output_test
