// `cutproof fuzz` and `cutproof replay` as a user meets them.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "property_tests/counterexample.h"
#include "property_tests/dissection.h"
#include "tests/cli/program.h"

namespace {

using nlohmann::json;
using namespace cutproof::property_tests;

class Fuzz : public Program {
 protected:
  json result(const std::string& name) const { return json::parse(read(name)); }
  // A body of six particles that one stroke parts.
  void write_counterexample(const std::string& name, const std::string& backend, const json& commands = json()) const {
    Counterexample counterexample;
    for (int32_t i = 0; i < 6; ++i) counterexample.failing.nodes.push_back({i, 0, 0});
    counterexample.failing.strokes = {{{10, -4, -4}, {10, -4, 4}, 2, true, Link::apart}};
    counterexample.backend = backend;
    counterexample.found = "something of long ago";
    json document = json::parse(to_json(counterexample));
    if (!commands.is_null()) document["commands"] = commands;
    write(name, document.dump());
  }
};

TEST_F(Fuzz, HoldsOnEveryBackendOfEveryMachineAndMeetsEveryClass) {
  for (const std::string backend : {"host", "reference"}) {
    const Outcome outcome =
        cutproof("fuzz --backend " + backend + " --cases 1000 --seed 7 --json " + backend + ".json");
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    const json document = result(backend + ".json");
    EXPECT_EQ(document["format"], "cutproof.fuzz");
    EXPECT_EQ(document["cases"], 1000);
    EXPECT_EQ(document["holds"], true);
    for (const CoverageClass& each : kCoverageClasses) {
      EXPECT_GE(document["coverage"][each.name], least_count(each, 1000, false)) << each.name;
    }
  }
  // Bodies that move meet more classes, contacts in at least one of ten cases.
  const Outcome moving = cutproof("fuzz --backend reference --dynamics --cases 1000 --seed 7 --json moving.json");
  EXPECT_EQ(moving.status, 0) << moving.output;
  const json document = result("moving.json");
  for (const CoverageClass& each : kCoverageClasses) {
    EXPECT_GE(document["coverage"][each.name], least_count(each, 1000, true)) << each.name;
  }
  const Outcome simulated = cutproof("fuzz --backend simulated --cases 260 --sizes 0-20 --seed 7");
  EXPECT_EQ(simulated.status, 0) << simulated.output;
}

TEST_F(Fuzz, ComparesEveryStepOfAMovingBodyWithTheReferences) {
  const std::string moving = "fuzz --backend host --dynamics --cases 200 --seed 7 --json ";
  const Outcome outcome = cutproof(moving + "whole.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("steps beside the reference's"), std::string::npos) << outcome.output;
  const json compared = result("whole.json").at("steps_compared");
  EXPECT_GE(compared.at("steps"), 200);
  EXPECT_GT(compared.at("particles"), 1000);
  EXPECT_LT(compared.at("undecidable").get<double>(), 0.05 * compared.at("particles").get<double>());
  EXPECT_GT(compared.at("greatest_h"), 0);
  EXPECT_LE(compared.at("greatest_h"), 1e-4);
  // How claims of threads end may differ from one load to another, and with them clusters: only sums are compared.
  json sum = {{"steps", 0}, {"particles", 0}, {"undecidable", 0}};
  double greatest = 0;
  for (const std::string shard : {"1", "2"}) {
    ASSERT_EQ(cutproof(moving + shard + ".json --shard " + shard + "/2").status, 0);
    const json part = result(shard + ".json").at("steps_compared");
    for (auto& [field, value] : sum.items()) value = value.get<int64_t>() + part.at(field).get<int64_t>();
    greatest = std::max(greatest, part.at("greatest_h").get<double>());
  }
  ASSERT_EQ(cutproof("fuzz --merge 1.json 2.json --json merged.json").status, 0);
  json merged = result("merged.json").at("steps_compared");
  EXPECT_EQ(merged.at("greatest_h"), greatest);
  EXPECT_EQ(merged.at("steps"), compared.at("steps"));
  merged.erase("greatest_h");
  EXPECT_EQ(merged, sum);

  // Nothing is compared with itself, and what does not move has no step to speak of.
  ASSERT_EQ(cutproof("fuzz --backend reference --dynamics --cases 20 --json a.json").status, 0);
  ASSERT_EQ(cutproof("fuzz --backend host --cases 20 --json b.json").status, 0);
  EXPECT_FALSE(result("a.json").contains("steps_compared") || result("b.json").contains("steps_compared"));
}

TEST_F(Fuzz, PutsShardsTogetherToTheWhole) {
  ASSERT_EQ(cutproof("fuzz --backend reference --cases 300 --sizes 0-40 --json whole.json").status, 0);
  for (const std::string shard : {"1", "2", "3"}) {
    const Outcome outcome =
        cutproof("fuzz --backend reference --cases 300 --sizes 0-40 --shard " + shard + "/3 --json " + shard + ".json");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_EQ(result(shard + ".json")["cases"], 100);
  }
  const Outcome merged = cutproof("fuzz --merge 1.json 2.json 3.json --json merged.json");
  EXPECT_EQ(merged.status, 0) << merged.output;
  const json whole = result("whole.json"), together = result("merged.json");
  for (const char* field : {"cases", "verdicts", "coverage", "holds"})
    EXPECT_EQ(together[field], whole[field]) << field;

  expect_refused("fuzz --merge 1.json 2.json", {"--merge", "missing: 3"});
  expect_refused("fuzz --merge 1.json 2.json 2.json", {"2.json", "given already"});
  expect_refused("fuzz --merge 1.json none.json", {"none.json"});
  json other = result("3.json");
  other["seed"] = 99;
  write("other.json", other.dump());
  expect_refused("fuzz --merge 1.json 2.json other.json", {"other.json", "seed", "99"});
  write("bad.json", "{}");
  expect_refused("fuzz --merge bad.json", {"bad.json"});

  // A shard that failed makes the whole fail.
  json failed = result("3.json");
  failed["violations"] = json::array({{{"index", 2}, {"text", "'coverage' fails"}, {"file", "x.json"}}});
  write("failed.json", failed.dump());
  const Outcome fails = cutproof("fuzz --merge 1.json 2.json failed.json");
  EXPECT_EQ(fails.status, 1);
  EXPECT_NE(fails.output.find("'coverage' fails"), std::string::npos);
}

TEST_F(Fuzz, RefusesBadUsage) {
  expect_refused("fuzz --backend nobody", {"--backend", "nobody", "simulated"});
  expect_refused("fuzz --sizes 5", {"--sizes", "0-79"});
  expect_refused("fuzz --sizes 9-5", {"--sizes"});
  expect_refused("fuzz --sizes 5-111", {"--sizes"});
  expect_refused("fuzz --shard 0/3", {"--shard", "2/8"});
  expect_refused("fuzz --shard 4/3", {"--shard"});
  expect_refused("fuzz --cases -1", {"--cases"});
  expect_refused("fuzz --save nowhere", {"--save", "nowhere"});
  expect_refused("fuzz --json nowhere/f.json", {"nowhere"});
  expect_refused("fuzz --backend reference --split global", {"--split"});
  expect_refused("fuzz --backend simulated --schedule-seed x", {"--schedule-seed"});
}

TEST_F(Fuzz, ReplaysWhereItWasFoundOrElsewhereAndRecords) {
  write_counterexample("case.json", "host");
  const Outcome here = cutproof("replay case.json");
  EXPECT_EQ(here.status, 0) << here.output;
  EXPECT_NE(here.output.find("backend host"), std::string::npos);
  EXPECT_NE(here.output.find("something of long ago"), std::string::npos);
  EXPECT_NE(here.output.find("holds"), std::string::npos);
  for (const std::string backend : {"reference", "simulated --schedule pct --schedule-seed 4"}) {
    EXPECT_EQ(cutproof("replay case.json --backend " + backend).status, 0) << backend;
  }
  ASSERT_EQ(cutproof("replay case.json --record r").status, 0);
  const Outcome checked = cutproof("check r");
  EXPECT_EQ(checked.status, 0) << checked.output;

  json history = json::parse(R"([{"run": 2, "whole": false}, {"save_and_load": "files"}, {"run": 10, "whole": true}])");
  write_counterexample("history.json", "host", history);
  const Outcome relived = cutproof("replay history.json");
  EXPECT_EQ(relived.status, 0) << relived.output;
  EXPECT_NE(relived.output.find("3 commands"), std::string::npos) << relived.output;
  expect_refused("replay history.json --record r", {"history.json", "--record"});
  history[0]["run"] = 0;
  write_counterexample("bad_history.json", "host", history);
  expect_refused("replay bad_history.json", {"bad_history.json", "commands", "run"});

  expect_refused("replay none.json", {"none.json"});
  write("bad.json", "{\"format\": \"cutproof.counterexample\"}");
  expect_refused("replay bad.json", {"bad.json", "format_version"});
  write_counterexample("other.json", "nobody");
  expect_refused("replay other.json", {"nobody"});
}

}  // namespace
