// Lines that GitHub takes for annotations: one line each, whatever stands in a witness.
#include "cli/annotations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace cutproof::cli::annotations_test {
namespace {

std::string printed(const std::vector<Failure>& failures, const char* github_actions) {
  if (github_actions != nullptr) {
    setenv("GITHUB_ACTIONS", github_actions, 1);
  } else {
    unsetenv("GITHUB_ACTIONS");
  }
  testing::internal::CaptureStdout();
  print_annotations(failures);
  std::fflush(stdout);
  unsetenv("GITHUB_ACTIONS");
  return testing::internal::GetCapturedStdout();
}

TEST(AnAnnotation, SaysWhatFailsAndHowToSeeItAgain) {
  EXPECT_EQ(annotation({"coverage", "particle 3 lies in no cluster", "cutproof replay x.json"}),
            "::error title=cutproof: coverage::particle 3 lies in no cluster; see it again: cutproof replay x.json");
}

TEST(AnAnnotation, EscapesWhatALineCannotHold) {
  EXPECT_EQ(annotation({"lockstep: 5 %, all", "100 %\r\nof: them, \x1B[31m", "cutproof run 'a\nb'"}),
            "::error title=cutproof: lockstep%3A 5 %25%2C all::100 %25%0D%0Aof: them, \\x1b[31m; see it again: "
            "cutproof run 'a%0Ab'");
}

TEST(Annotations, AreForGitHubAlone) {
  const std::vector<Failure> failures = {{"coverage", "a", "b"}, {"finite", "c", "d"}};
  EXPECT_EQ(printed(failures, "true"), annotation(failures[0]) + "\n" + annotation(failures[1]) + "\n");
  EXPECT_EQ(printed(failures, "false"), "");
  EXPECT_EQ(printed(failures, ""), "");
  EXPECT_EQ(printed(failures, nullptr), "");
  EXPECT_EQ(printed({}, "true"), "");
}

TEST(Annotations, SayHowManyGitHubWouldNotShow) {
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  const std::string ten = printed(std::vector<Failure>(10, {"coverage", "a", "b"}), "true");
  EXPECT_EQ(lines(ten), 10);
  EXPECT_EQ(ten.find("not shown"), std::string::npos);
  const std::string more = printed(std::vector<Failure>(13, {"coverage", "a", "b"}), "true");
  EXPECT_EQ(lines(more), 10);
  EXPECT_NE(more.find("a (and 3 more that are not shown here); see"), std::string::npos) << more;
}

TEST(Annotations, WarnOfStagesThatWereLeftToTheReferenceBesideFailures) {
  const Failure failure = {"coverage", "a", "b"};
  const std::string warned = "::warning title=cutproof: not judged::the reference ran step, skin for the backend\n";
  setenv("GITHUB_ACTIONS", "true", 1);
  testing::internal::CaptureStdout();
  print_annotations({failure}, {"step", "skin"});
  print_annotations({}, {"step", "skin"});
  std::fflush(stdout);
  unsetenv("GITHUB_ACTIONS");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), annotation(failure) + "\n" + warned + warned);
  EXPECT_EQ(warning("a: b", "100 %"), "::warning title=cutproof: a%3A b::100 %25");
}

TEST(AStepSummary, SaysInMarkdownWhatFailsAndHowToSeeItAgain) {
  EXPECT_EQ(step_summary({"cutproof run a_b"}), "### cutproof run a\\_b: holds\n\n");
  const std::string text = step_summary({"cutproof check x",
                                         {{"coverage", "a | b\n<c> & *d*", "cutproof check 'x y'"}},
                                         {"step"},
                                         {"finite after skin"},
                                         {"Mended: motion"}});
  EXPECT_EQ(text,
            "### cutproof check x: 1 failure\n\n"
            "- **coverage**: a \\| b\\\\n&lt;c\\> &amp; \\*d\\*\n\n      cutproof check 'x y'\n\n"
            "Fails as in the baseline: finite after skin\n\n"
            "Not judged: the reference ran step for the backend\n\n"
            "Mended: motion\n\n");
  const std::string many = step_summary({"x", std::vector<Failure>(60, {"coverage", std::string(5000, 'a'), "b"})});
  EXPECT_LT(many.size(), 200'000u) << "GitHub takes no more than 1 MiB of a step";
  EXPECT_NE(many.find("- and 10 more\n"), std::string::npos);
}

}  // namespace
}  // namespace cutproof::cli::annotations_test
