// What a person sees of verdicts that were made by hand.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/findings.h"
#include "cli/terminal.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli::shown_verdicts_test {
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

// In one row, in whatever order: what the scene expects excuses nothing else.
TEST(JunitCases, AreNotPassedByAnExpectedFailureBesideAnUnexpectedOne) {
  const Judging judging{"cutproof check", "cutproof.check", "cutproof check it"};
  const Verdict foreseen = failing_verdict("isolation", Stage::skin, 3, "as expected"),
                unforeseen = failing_verdict("isolation", Stage::skin, 4, "nobody expects this");
  Verdict fine = foreseen;
  fine.holds = true;
  const auto is_expected = [&](const Verdict& verdict) { return verdict.witness.text == "as expected"; };
  for (const auto& verdicts : {std::vector<Verdict>{foreseen, unforeseen, fine}, {unforeseen, fine, foreseen}}) {
    const auto cases = cases_of(verdicts, judging, is_expected);
    ASSERT_EQ(cases.size(), 1U);
    EXPECT_EQ(cases[0].outcome, io::JunitOutcome::failed);
    EXPECT_EQ(cases[0].message, "nobody expects this");
    EXPECT_NE(cases[0].text.find("1 of 3 verdicts fail"), std::string::npos) << cases[0].text;
    const std::vector<Failure> failures = failures_of(verdicts, judging, is_expected);
    ASSERT_EQ(failures.size(), 1U);
    EXPECT_EQ(failures[0].text, "nobody expects this");
  }
  const auto alone = cases_of({foreseen, fine}, judging, is_expected);
  EXPECT_EQ(alone.at(0).outcome, io::JunitOutcome::passed);
  EXPECT_NE(alone.at(0).text.find("as the scene expects"), std::string::npos);
}

// A row that looked at nothing is skipped with its reason; one verdict that looked is enough for it to pass.
TEST(JunitCases, AreSkippedWhereNoVerdictLookedAtAnything) {
  const Judging judging{"cutproof check", "cutproof.check", "cutproof check it"};
  Verdict vacuous = failing_verdict("no pass", Stage::detect, 0, "");
  vacuous.holds = true;
  vacuous.checked = 0;
  vacuous.vacuous = "no blade";
  Verdict looked = vacuous;
  looked.checked = 1;
  EXPECT_EQ(cases_of({vacuous, vacuous}, judging).at(0).outcome, io::JunitOutcome::skipped);
  EXPECT_EQ(cases_of({vacuous, vacuous}, judging).at(0).message, "nothing to look at: no blade");
  EXPECT_EQ(cases_of({vacuous, looked}, judging).at(0).outcome, io::JunitOutcome::passed);
}

// What is asked of the judging itself is no property, and no bound of it is one to come near to.
TEST(ShownVerdicts, CountNoPropertyThatOnlySaysThatEnoughWasJudged) {
  Verdict property = failing_verdict("momentum", Stage::step, 0, ""), gate = property, whole = property;
  gate.property = "something was judged";
  whole.property = "the run is whole";
  for (Verdict* const one : {&property, &gate, &whole}) {
    one->holds = true;
    one->measured = one == &property ? 0.25 : 1;
    one->bound = 1;
  }
  const std::string text = printed({property, gate, whole});
  for (const char* const words : {"1 property holds;", "momentum after step", "at 0.25 of it."})
    EXPECT_NE(text.find(words), std::string::npos) << text;
  gate.holds = false;
  gate.witness.text = "nothing";
  EXPECT_NE(printed({property, gate}).find("FAILS: something was judged, in frame 0"), std::string::npos);
}

// What demands at least its bound holds by being there: nothing is as near to it as that.
TEST(ShownVerdicts, TakeWhatDemandsItsBoundForNoNearMiss) {
  Verdict met = failing_verdict("the kick was felt", Stage::skin, 0, ""),
          near = failing_verdict("motion", Stage::step, 0, "");
  met.holds = near.holds = true;
  met.measured = met.bound = near.bound = 1;
  near.measured = 0.25;
  EXPECT_NE(printed({met, near}).find("nearest to its bound: motion after step, at 0.25 of it"), std::string::npos)
      << printed({met, near});
}

TEST(ShownVerdicts, CountWhatHasNoUnitAndNoBound) {
  Verdict counted = failing_verdict("finite", Stage::skin, 0, "a");
  counted.unit = "1";
  counted.measured = 20;
  counted.bound = 0;
  EXPECT_NE(printed({counted}).find("counted 20, bound 0"), std::string::npos) << printed({counted});
}

TEST(ShownVerdicts, SayOneOnlyOfWhatIsExactlyAtItsBound) {
  EXPECT_EQ(io::share_of(0.9996), "0.99");
  EXPECT_EQ(io::share_of(1), "1");
  EXPECT_EQ(io::share_of(1.0004), "1.01");
  EXPECT_EQ(io::share_of(0.376), "0.38");
  EXPECT_EQ(io::share_of(123), "1.2e+02");
}

TEST(JunitCases, HaveTheTimeThatTheirVerdictsTookAndClassesWithoutTheDotsOfPaths) {
  Verdict one = failing_verdict("coverage", Stage::split, 3, "an edge"), another = one;
  one.took.seconds = 0.25;
  another.took.seconds = 0.5;
  const auto cases = cases_of({one, another}, {"cutproof run", class_of("run", "./a.b/c"), "cutproof run it"});
  ASSERT_EQ(cases.size(), 1U);
  EXPECT_EQ(cases[0].seconds, 0.75);
  EXPECT_EQ(cases[0].class_name, "cutproof.run._/a_b/c");
  EXPECT_EQ(class_of("kick"), "cutproof.kick");
}

TEST(Failures, AreOneForEachProperty) {
  const Judging judging{"cutproof check", "cutproof.check", "cutproof check it"};
  const std::vector<Failure> failures = failures_of(
      {failing_verdict("coverage", Stage::split, 3, "first"), failing_verdict("finite", Stage::skin, 3, "b"),
       failing_verdict("coverage", Stage::skin, 4, "later")},
      judging);
  ASSERT_EQ(failures.size(), 2U);
  EXPECT_EQ(failures[0].text, "first (the first of 2 verdicts that fail)");
  EXPECT_EQ(failures[1].text, "b");
}

TEST(JunitCases, SkipEachStageThatWasLeftToTheReference) {
  const auto cases = cases_of_left({"step", "skin"}, {"cutproof run", "cutproof.run", "cutproof run it"});
  ASSERT_EQ(cases.size(), 2U);
  EXPECT_EQ(cases[1].name, "stage skin");
  EXPECT_EQ(cases[1].outcome, io::JunitOutcome::skipped);
  EXPECT_NE(cases[1].message.find("not judged"), std::string::npos);
}

// A campaign's document: what fails, in the case that is shown, and what as a whole was too little.
TEST(JunitCases, OfACampaignNameEveryViolationAndTheWhole) {
  const Judging judging{"cutproof fuzz", "cutproof.fuzz", "cutproof fuzz it"};
  const auto property = [](const char* name, int64_t judged, int64_t failed) {
    return nlohmann::json{
        {"property", name}, {"stage", "step"}, {"judged", judged}, {"failed", failed}, {"seconds", 0.25}};
  };
  const nlohmann::json violation = {
      {"index", 7},
      {"property", "motion"},
      {"stage", "step"},
      {"text", "as it was drawn"},
      {"witness", "far"},
      {"file", "found.json"},
      {"shrunk", {{"text", "as it is shown"}, {"property", "coverage"}, {"witness", "near"}}}};
  const nlohmann::json document = {
      {"properties", {property("motion", 3, 1), property("finite", 3, 0), property("no pass", 0, 0)}},
      {"violations", {violation}},
      {"complete", true},
      {"left_to_reference", {"skin"}}};
  const auto cases = cases_of_campaign(document, "1 of 8 cases", judging);
  std::map<std::string, io::JunitCase> by_name;
  for (const io::JunitCase& one : cases) by_name[one.name] = one;
  EXPECT_EQ(by_name.size(), cases.size());
  EXPECT_EQ(by_name.at("motion after step").outcome, io::JunitOutcome::failed);
  EXPECT_EQ(by_name.at("motion after step").message, "near");
  EXPECT_NE(by_name.at("motion after step").text.find("case 7: as it is shown"), std::string::npos);
  EXPECT_NE(by_name.at("motion after step").text.find("cutproof replay found.json"), std::string::npos);
  EXPECT_EQ(by_name.at("finite after step").outcome, io::JunitOutcome::passed);
  EXPECT_EQ(by_name.at("finite after step").seconds, 0.25);
  EXPECT_EQ(by_name.at("no pass after step").outcome, io::JunitOutcome::skipped);
  EXPECT_EQ(by_name.at("stage skin").outcome, io::JunitOutcome::skipped);
  EXPECT_EQ(by_name.at("enough was judged").outcome, io::JunitOutcome::passed) << "a property fails, and says so";
  const std::vector<Failure> failures = failures_of_campaign(document, "1 of 8 cases", judging);
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_EQ(failures[0].property, "coverage") << "of the case that the command shows";
  EXPECT_EQ(failures[0].text, "near");
  EXPECT_EQ(failures[0].again, "cutproof replay found.json");

  // Nothing fails, and too little was judged; or not all of it.
  nlohmann::json little = document;
  little["violations"] = nlohmann::json::array();
  for (const bool complete : {true, false}) {
    little["complete"] = complete;
    const io::JunitCase whole = cases_of_campaign(little, "nothing was judged", judging).back();
    EXPECT_EQ(whole.name, "enough was judged");
    EXPECT_EQ(whole.outcome, complete ? io::JunitOutcome::failed : io::JunitOutcome::error);
    EXPECT_EQ(whole.message, "nothing was judged");
    ASSERT_EQ(failures_of_campaign(little, "nothing was judged", judging).size(), 1U);
  }
}

}  // namespace
}  // namespace cutproof::cli::shown_verdicts_test
