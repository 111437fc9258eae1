// What a person sees of verdicts that were made by hand.
#include <gtest/gtest.h>

#include <string>
#include <vector>

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

}  // namespace
}  // namespace cutproof::cli
