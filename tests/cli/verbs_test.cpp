// Usage, standard output and gates that judged nothing, of every verb.
#include "tests/cli/verbs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "model/io/array_file.h"

namespace verbs_test {
namespace {

using namespace cutproof;
using nlohmann::json;

// --- Standard output
// --------------------------------------------------------------------------------------------------

TEST_F(Verbs, EndWithStatusThreeAndOneMessageIfStandardOutputCannotBeWritten) {
  if (!files::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  record();
  for (const std::string& command : commands()) {
    const Outcome outcome = cutproof(command + " 2> error > /dev/full; exit $? #");
    EXPECT_EQ(outcome.status, 3) << command;
    const std::string error = read("error");
    EXPECT_TRUE(error.starts_with("cutproof: ")) << command << ": " << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << command << ": " << error;
    // The reason, unless a library has swallowed it.
    const bool says_why = error.find("No space left on device") != std::string::npos;
    EXPECT_TRUE(says_why || error.find("standard output") != std::string::npos) << command << ": " << error;
  }
}

TEST_F(Verbs, SucceedIfItCan) {
  record();
  for (const std::string& command : commands()) {
    const Outcome outcome = cutproof(command);
    EXPECT_EQ(outcome.status, 0) << command << "\n" << outcome.output;
  }
}

// A result that cannot be shown is written down all the same, so the status is not that of a run that holds.
TEST_F(Verbs, WriteTheirDocumentEvenIfStandardOutputCannotBeWritten) {
  if (!files::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  EXPECT_EQ(cutproof("run cut.json --check --json out.json 2> error > /dev/full; exit $? #").status, 3);
  EXPECT_TRUE(json::parse(read("out.json")).at("summary").at("holds"));
}

// --- digest ----------------------------------------------------------------------------------------------------------

TEST_F(Verbs, DigestTellsRunsApartByTheirBits) {
  record();
  const std::string first = cutproof("digest seen").output;
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 1 + 2 * 2 + 1) << "start, step and skin of two frames, all\n"
                                                                         << first;
  EXPECT_NE(first.find("snapshot 0, start, frame 0\n"), std::string::npos) << first;
  EXPECT_NE(first.find("snapshot 4, skin, frame 1\n"), std::string::npos) << first;
  record();
  EXPECT_EQ(cutproof("digest seen").output, first);
  ASSERT_EQ(cutproof("run cut.json --backend host --record seen").status, 0);
  const std::string other = cutproof("digest seen").output;
  EXPECT_NE(other.substr(0, 16), first.substr(0, 16)) << "single precision";
  expect_refused("digest nowhere", {"nowhere"});
}

// --- report ----------------------------------------------------------------------------------------------------------

TEST_F(Verbs, ReportMakesAPageOfARunACheckAndARecording) {
  record();
  if (CUTPROOF_HAS_PAGES == 0) {
    for (const char* const one : {"run cut.json --report page.html", "check seen --report page.html"})
      expect_refused(one, {"--report", "built without report pages", "libjs-three"});
    expect_refused("report seen -o page.html", {"built without report pages", "libjs-three"});
    return;
  }
  // Nothing but the page: what it was made from is gone.
  std::set<std::string> before = listing();
  ASSERT_EQ(cutproof("run cut.json --check --report run.html --json run.json").status, 0);
  before.insert({"run.html", "run.json"});
  EXPECT_EQ(listing(), before);
  ASSERT_EQ(cutproof("check seen --report check.html").status, 0);
  const Outcome made = cutproof("report seen run.json -o report.html");
  EXPECT_EQ(made.status, 0) << made.output;
  EXPECT_NE(made.output.find("wrote report.html"), std::string::npos) << made.output;
  for (const char* const name : {"run.html", "check.html", "report.html"}) {
    const std::string page = read(name);
    EXPECT_TRUE(page.starts_with("<!DOCTYPE html>")) << name;
    EXPECT_NE(page.find("scene small"), std::string::npos) << name;
  }
  EXPECT_NE(read("run.html").find("\"again\":\"cutproof run cut.json --check"), std::string::npos);
  EXPECT_NE(read("report.html").find("\"again\":\"cutproof check seen\""), std::string::npos);
  expect_refused("report nowhere -o page.html", {"nowhere"});
  expect_refused("report seen cut.json -o page.html", {"cut.json", "format", "remedy"});
  expect_refused("report seen run.json -o nowhere/page.html", {"nowhere"});
  write("bad.json", "{");
  expect_refused("report seen bad.json -o page.html", {"bad.json", "--json"});
}

// Of what verbs other than run and check write; what does not go together is refused by the file that does not.
TEST_F(Verbs, ReportMakesAPageOfEveryDocumentAndRefusesWhatDoesNotGoTogether) {
  if (CUTPROOF_HAS_PAGES == 0) {
    for (const char* const one : {"fuzz --cases 5 --report page.html", "bench machine_limits --report page.html",
                                  "tune cut.json --tolerance 1 --report page.html"})
      expect_refused(one, {"--report", "built without report pages"});
    return;
  }
  record();
  for (const char* const one :
       {"fuzz --cases 5 --report nowhere/p.html", "bench machine_limits --report nowhere/p.html",
        "tune cut.json --tolerance 1 --report nowhere/p.html"})
    expect_refused(one, {"nowhere"});
  ASSERT_EQ(cutproof("fuzz --cases 20 --sizes 0-9 --seed 3 --json fuzz.json --report fuzz.html").status, 0);
  ASSERT_EQ(cutproof("bench machine_limits --repeats 2 --json limits.json --report limits.html").status, 0);
  ASSERT_EQ(cutproof("run cut.json --check topology --json run.json").status, 0);
  for (const char* const name : {"fuzz", "limits"}) {
    const std::string file(name);
    const Outcome made = cutproof("report " + file + ".json -o again.html");
    EXPECT_EQ(made.status, 0) << made.output;
    EXPECT_NE(made.output.find("everything on the page holds"), std::string::npos) << made.output;
    // When it was made, and by which command, differs.
    const auto without_head = [&](const std::string& which) {
      std::string page = read(which);
      const std::size_t first = page.find("\"made\":{");
      return page.erase(first, page.find('}', first) - first);
    };
    EXPECT_EQ(without_head("again.html"), without_head(file + ".html")) << "--report and report make the same page";
  }
  EXPECT_NE(read("fuzz.html").find("cutproof fuzz --backend host --cases 20 --seed 3 --sizes 0-9"), std::string::npos);
  EXPECT_NE(read("limits.html").find("cutproof bench machine_limits --repeats 2"), std::string::npos);
  write("copy.json", read("fuzz.json"));
  const std::set<std::string> before = listing();
  expect_refused("report fuzz.json limits.json -o p.html", {"limits.json", "format", "does not go with"});
  expect_refused("report seen limits.json -o p.html", {"limits.json", "does not go with a recording"});
  expect_refused("report run.json -o p.html", {"run.json", "give the recording"});
  expect_refused("report limits.json limits.json -o p.html", {"limits.json", "twice"});
  expect_refused("report seen.cutproof.h5 other -o p.html", {"other"});
  const std::string counterexample = CUTPROOF_SOURCE "/fixtures/regressions/pair_on_a_wall.json";
  expect_refused("report fuzz.json " + counterexample + " -o p.html", {"pair_on_a_wall.json", "no such violation"});
  expect_refused("report fuzz.json copy.json -o p.html", {"json", "a page shows one"});
  EXPECT_EQ(listing(), before) << "nothing half-written is left";
  const Outcome alone = cutproof("report " + counterexample + " -o alone.html --backend reference");
  EXPECT_EQ(alone.status, 0) << alone.output;
  EXPECT_NE(alone.output.find("everything on the page holds"), std::string::npos) << alone.output;
}

// A document may name any library; none is run because a document says so.
TEST_F(Verbs, ReportRunsAPluginOnlyIfTheCommandLineNamesIt) {
  if (CUTPROOF_HAS_PAGES == 0) GTEST_SKIP() << "this build has no report pages";
  std::string text = read(CUTPROOF_SOURCE "/fixtures/regressions/split_leaves_a_component_out.json");
  const std::string key = "\"backend\":\"";
  const std::size_t first = text.find(key) + key.size();
  text.replace(first, text.find('"', first) - first, "plugin:./libevil.so");
  write("evil.json", text);
  const Outcome made = cutproof("report evil.json -o page.html");
  EXPECT_EQ(made.status, 0) << made.output;
  EXPECT_NE(made.output.find("nothing on the page is judged"), std::string::npos) << made.output;
  EXPECT_NE(read("page.html").find("a plugin is run only if --backend names it"), std::string::npos);
}

// What a page is made from has a name no longer than it is written.
TEST_F(Verbs, ReportLeavesNothingOfARunThatFailsAfterIt) {
  if (CUTPROOF_HAS_PAGES == 0) GTEST_SKIP() << "this build has no report pages";
  if (!files::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  const std::set<std::string> before = listing();
  EXPECT_EQ(cutproof("run cut.json --check --report page.html --json /dev/full").status, 3);
  EXPECT_EQ(listing(), before);
}

// --- Usage
// ------------------------------------------------------------------------------------------------------------

TEST_F(Verbs, RefuseWhatIsGivenButEmpty) {
  record();
  for (const auto& [command, option] :
       std::vector<std::pair<std::string, std::string>>{{"run cut.json --json ''", "--json"},
                                                        {"run cut.json --json=", "--json"},
                                                        {"run cut.json --record ''", "--record"},
                                                        {"run cut.json --errors ''", "--errors"},
                                                        {"run cut.json --against ''", "--against"},
                                                        {"run cut.json --backend ''", "--backend"},
                                                        {"run cut.json --mesh ''", "--mesh"},
                                                        {"run ''", "scene"},
                                                        {"check seen --json ''", "--json"},
                                                        {"check ''", "recording"},
                                                        {"check state.npz --json ''", "--json"},
                                                        {"kick kick.npz --json ''", "--json"},
                                                        {"kick ''", "file"},
                                                        {"vectors split -o ''", "--output"},
                                                        {"vectors '' -o v.npz", "operation"},
                                                        {"check-vectors '' answers.npz", "vectors"},
                                                        {"check-vectors vectors.npz ''", "answers"},
                                                        {"check-vectors vectors.npz answers.npz --json ''", "--json"},
                                                        {"check-vectors vectors.npz answers.npz --junit ''", "--junit"},
                                                        {"digest ''", "recording"},
                                                        {"run cut.json --report ''", "--report"},
                                                        {"check seen --report ''", "--report"},
                                                        {"report '' -o page.html", "files"},
                                                        {"report seen -o ''", "--output"},
                                                        {"fuzz --cases 5 --json ''", "--json"},
                                                        {"fuzz --cases 5 --shard ''", "--shard"},
                                                        {"fuzz --cases 5 --save ''", "--save"},
                                                        {"fuzz --merge ''", "--merge"},
                                                        {"replay '" + counterexample() + "' --record ''", "--record"},
                                                        {"replay '" + counterexample() + "' --backend ''", "--backend"},
                                                        {"tune cut.json --tolerance 1 --json ''", "--json"},
                                                        {"tune cut.json --tolerance 1 --write ''", "--write"},
                                                        {"bench stages --sizes 1000 --json ''", "--json"},
                                                        {"bench stages --scenes ''", "--scenes"},
                                                        {"bench sampling --json ''", "--json"},
                                                        {"bench clusters --json ''", "--json"},
                                                        {"bench scale --json ''", "--json"},
                                                        {"bench rotations --json ''", "--json"},
                                                        {"bench machine_limits --json ''", "--json"},
                                                        {"bench solver --json ''", "--json"},
                                                        {"bench baselines --json ''", "--json"}}) {
    expect_refused(command, {option});
  }
}

TEST_F(Verbs, RefuseUnknownOptionsMissingValuesAndNegativeCounts) {
  for (const auto& [command, word] :
       std::vector<std::pair<std::string, std::string>>{{"run cut.json --frobnicate", "--frobnicate"},
                                                        {"run cut.json more.json", "more.json"},
                                                        {"run cut.json --json", "--json"},
                                                        {"run cut.json --frames -1", "--frames"},
                                                        {"run cut.json --particles -1", "--particles"},
                                                        {"check seen --frobnicate", "--frobnicate"},
                                                        {"kick kick.npz --frobnicate", "--frobnicate"},
                                                        {"kick", "file"},
                                                        {"kick state.npz", "edges"},
                                                        {"vectors split", "--output"},
                                                        {"vectors cut -o v.npz", "cut"},
                                                        {"vectors split -o v.npz --cases -1", "--cases"},
                                                        {"vectors split -o v.npz --seed -1", "--seed"},
                                                        {"vectors split -o v.npz --precision half", "--precision"},
                                                        {"check-vectors vectors.npz", "answers"},
                                                        {"check-vectors state.npz answers.npz", "schema"},
                                                        {"check-vectors vectors.npz kick.npz", "label"},
                                                        {"check-vectors vectors.npz answers.npz --promises no", "'no'"},
                                                        {"check kick.npz", "kicked"},
                                                        {"check state.npz --check deep", "deep"},
                                                        {"digest seen --frobnicate", "--frobnicate"},
                                                        {"report seen", "--output"},
                                                        {"report -o page.html", "files"},
                                                        {"report seen -o -", "--output"},
                                                        {"run cut.json --report -", "--report"},
                                                        {"check state.npz --report -", "--report"},
                                                        {"kick kick.npz --report -", "--report"},
                                                        {"relate seen seen --map same --report -", "--report"},
                                                        {"check seen --json", "--json"},
                                                        {"info --frobnicate", "--frobnicate"},
                                                        {"fuzz --frobnicate", "--frobnicate"},
                                                        {"fuzz --cases", "--cases"},
                                                        {"fuzz --cases -1", "--cases"},
                                                        {"fuzz --cases 1.5", "--cases"},
                                                        {"fuzz --seconds -1", "--seconds"},
                                                        {"fuzz --shrink -1", "--shrink"},
                                                        {"fuzz --seed -1", "--seed"},
                                                        {"fuzz --batch 0", "--batch"},
                                                        {"fuzz --threads -1", "--threads"},
                                                        {"replay case.json --frobnicate", "--frobnicate"},
                                                        {"replay case.json --record", "--record"},
                                                        {"tune cut.json --tolerance 1 --frobnicate", "--frobnicate"},
                                                        {"tune cut.json --tolerance", "--tolerance"},
                                                        {"tune cut.json --tolerance 1 --frames 0", "--frames"},
                                                        {"tune cut.json --tolerance 1 --repeats -1", "--repeats"},
                                                        {"tune cut.json --tolerance 1 --answer limit", "--answer"},
                                                        {"bench stages --frobnicate", "--frobnicate"},
                                                        {"bench stages --frames -1", "--frames"},
                                                        {"bench stages --sizes -1000", "--sizes"},
                                                        {"bench sampling --repeats -1", "--repeats"},
                                                        {"bench clusters --particles -1", "--particles"},
                                                        {"bench scale --sizes", "--sizes"},
                                                        {"bench rotations --matrices -1", "--matrices"},
                                                        {"bench machine_limits --repeats -1", "--repeats"},
                                                        {"bench floors", "machine_limits"},
                                                        {"bench solver --samples -1", "--samples"},
                                                        {"bench solver --particles -1", "--particles"},
                                                        {"bench baselines --particles -1", "--particles"}}) {
    expect_refused(command, {word});
  }
}

// --- Gates that judged nothing
// ----------------------------------------------------------------------------------------

TEST_F(Verbs, FailACampaignThatJudgedNothing) {
  for (const char* nothing : {"--cases 0", "--seconds 0", "--cases 1 --shard 2/2"}) {
    const Outcome outcome = cutproof(std::string("fuzz --json out.json ") + nothing);
    EXPECT_EQ(outcome.status, 1) << nothing << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find("FAILS: nothing was judged"), std::string::npos) << outcome.output;
    EXPECT_EQ(outcome.output.find("all hold"), std::string::npos) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("cases"), 0);
    EXPECT_FALSE(document.at("holds"));
  }
  // Nor do all shards together hold, if none of them judged anything.
  for (const std::string shard : {"1", "2"}) {
    EXPECT_EQ(cutproof("fuzz --cases 0 --shard " + shard + "/2 --json " + shard + ".json").status, 1);
  }
  const Outcome merged = cutproof("fuzz --merge 1.json 2.json --json merged.json");
  EXPECT_EQ(merged.status, 1) << merged.output;
  EXPECT_NE(merged.output.find("nothing was judged"), std::string::npos) << merged.output;
  EXPECT_FALSE(json::parse(read("merged.json")).at("holds"));
}

// Of dead particles alone there is nothing to say.
TEST_F(Verbs, FailTestVectorsOfWhichNothingWasJudged) {
  io::ArrayFile vectors = io::read_array_file(path("vectors.npz")), answers = io::read_array_file(path("answers.npz"));
  for (Array& array : vectors.arrays) {
    if (array.name == "alive") std::fill(array.bytes.begin(), array.bytes.end(), std::byte{0});
    if (array.name == "answer_label") std::fill(array.bytes.begin(), array.bytes.end(), std::byte{0xff});  // -1
  }
  io::write_array_file(path("dead.npz"), vectors);
  const Outcome outcome = cutproof("check-vectors dead.npz answers.npz --json out.json");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("FAILS: nothing was judged"), std::string::npos) << outcome.output;
  EXPECT_FALSE(json::parse(read("out.json")).at("summary").at("holds"));
}

// The irregular path has no body of boxes.
TEST_F(Verbs, FailABenchmarkThatMeasuredNothing) {
  const Outcome outcome = cutproof("bench stages --scenes irregular --clusters boxes --json out.json");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("nothing was measured"), std::string::npos) << outcome.output;
  EXPECT_FALSE(files::exists(path("out.json")));
}

TEST_F(Verbs, FailATuningThatFoundNothing) {
  const Outcome outcome = cutproof("tune cut.json --tolerance 1e-9 --frames 1 --repeats 1 --json out.json");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  const json document = json::parse(read("out.json"));
  EXPECT_TRUE(document.at("trials").empty());
  EXPECT_TRUE(document.at("found").is_null());
}

}  // namespace
}  // namespace verbs_test
