// What a person sees of verdicts that were made by hand.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/findings.h"
#include "cli/terminal.h"

namespace cutproof::cli {
namespace {

std::string printed_of_failing(int properties) {
  std::vector<Verdict> verdicts;
  for (int k = 0; k < properties; ++k) {
    Verdict& verdict = verdicts.emplace_back();
    verdict.property = "property " + std::to_string(k);
    verdict.holds = false;
    verdict.checked = 1;
    verdict.measured = 1;
    verdict.unit = "1";
  }
  testing::internal::CaptureStdout();
  print_verdicts(verdicts, Shown{});
  return testing::internal::GetCapturedStdout();
}

TEST(ShownVerdicts, CountThoseThatAreNotShown) {
  EXPECT_EQ(printed_of_failing(5).find("--json holds all verdicts"), std::string::npos);
  for (const auto& [properties, text] :
       {std::pair{6, "… and 1 more property fails; --json"}, {7, "… and 2 more properties fail; --json"}}) {
    const std::string printed = printed_of_failing(properties);
    EXPECT_NE(printed.find(text), std::string::npos) << printed;
  }
}

Verdict failing_verdict(const char* property, Stage stage, int64_t frame, const char* witness) {
  Verdict verdict;
  verdict.property = property;
  verdict.stage = stage;
  verdict.frame = frame;
  verdict.holds = false;
  verdict.checked = 1;
  verdict.bound_source = "some page";
  verdict.witness.text = witness;
  return verdict;
}

std::string printed(const std::vector<Verdict>& verdicts) {
  testing::internal::CaptureStdout();
  print_verdicts(verdicts, Shown{});
  return testing::internal::GetCapturedStdout();
}

// Momentum is judged first in each frame, and was fine until what the split did.
TEST(ShownVerdicts, BeginWithWhatFailsFirst) {
  Verdict fine = failing_verdict("momentum", Stage::step, 0, "");
  fine.holds = true;
  const std::string text = printed({fine, failing_verdict("exactness", Stage::split, 0, "a"),
                                    failing_verdict("earlier in the frame", Stage::detect, 0, "b"),
                                    failing_verdict("momentum", Stage::step, 1, "c")});
  const std::size_t first = text.find("earlier in the frame"), second = text.find("exactness"),
                    third = text.find("momentum after step");
  ASSERT_NE(third, std::string::npos) << text;
  EXPECT_LT(first, second) << text;
  EXPECT_LT(second, third) << text;
}

TEST(ShownVerdicts, HaveNoFiguresOfWhatCouldNotBeJudged) {
  const std::string text = printed({failing_verdict("geometry", Stage::skin, 3, "could not be judged: it is open")});
  EXPECT_NE(text.find("FAILS: geometry"), std::string::npos) << text;
  EXPECT_NE(text.find("could not be judged: it is open"), std::string::npos) << text;
  EXPECT_EQ(text.find("measured"), std::string::npos) << text;
}

// Nor has a JUnit file: "measured 0, bound 0" reads as if nothing were wrong.
TEST(JunitCases, HaveNoFiguresOfWhatCouldNotBeJudged) {
  const Judging judging{"cutproof check", "cutproof.check", "cutproof check it"};
  const auto cases = cases_of({failing_verdict("geometry", Stage::skin, 3, "could not be judged: it is open"),
                               failing_verdict("coverage", Stage::split, 3, "an edge")},
                              judging);
  ASSERT_EQ(cases.size(), 2U);
  const auto has = [](const io::JunitCase& one, const char* part) { return one.text.find(part) != std::string::npos; };
  EXPECT_TRUE(has(cases[0], "could not be judged: it is open")) << cases[0].text;
  EXPECT_FALSE(has(cases[0], "measured")) << cases[0].text;
  EXPECT_TRUE(has(cases[1], "measured 0, bound 0 (some page)")) << cases[1].text;
}

}  // namespace
}  // namespace cutproof::cli
