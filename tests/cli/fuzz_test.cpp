// `cutproof fuzz` and `cutproof replay` as a user meets them.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "property_tests/counterexample.h"
#include "property_tests/dissection.h"
#include "tests/program.h"

namespace fuzz_test {
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
  EXPECT_LT(compared.at("not_compared").get<double>(), 0.05 * compared.at("particles").get<double>());
  EXPECT_GT(compared.at("greatest_h"), 0);
  EXPECT_LE(compared.at("greatest_h"), 1e-4);
  // How claims of threads end may differ from one load to another, and with them clusters: only sums are compared.
  json sum = {{"steps", 0}, {"particles", 0}, {"not_compared", 0}};
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
  EXPECT_EQ(together["complete"], true);
  EXPECT_EQ(together["missing_shards"], json::array());
  // In everything that is no time and not how it was divided, whatever the order of the shards.
  const auto without_times = [](json document) {
    for (const char* field :
         {"seconds", "cases_per_second", "thread_seconds", "complete", "missing_shards", "merged_shards"}) {
      document.erase(field);
    }
    for (json& property : document["properties"]) property.erase("seconds");
    return document;
  };
  EXPECT_EQ(without_times(together), without_times(whole));
  ASSERT_EQ(cutproof("fuzz --merge 3.json 1.json 2.json --json other_order.json").status, 0);
  EXPECT_EQ(without_times(result("other_order.json")), without_times(whole));

  expect_refused("fuzz --merge 1.json 2.json 2.json", {"2.json", "shard 2 was given already"});
  expect_refused("fuzz --merge 1.json none.json", {"none.json"});
  // One of another campaign is that, even if its shard was given already.
  for (const auto& [field, value] : std::vector<std::pair<std::string, json>>{{"seed", 99},
                                                                              {"cutproof", "0.0.1"},
                                                                              {"commit", "0123abcd"},
                                                                              {"backend", "host"},
                                                                              {"schedule_seed", 4},
                                                                              {"sizes", json{0, 41}},
                                                                              {"dynamics", true},
                                                                              {"batch", 17},
                                                                              {"keep_going", true},
                                                                              {"cases_asked", 301},
                                                                              {"shards", 4}}) {
    for (const char* shard : {"3.json", "1.json"}) {
      json other = result(shard);
      ASSERT_NE(other.value(field, json()), value) << field;
      other[field] = value;
      write("other.json", other.dump());
      expect_refused("fuzz --merge 1.json 2.json other.json", {"other.json", field, value.dump()});
    }
  }
  const std::string text = read("3.json");
  for (const std::size_t bytes : {text.size() - 3, text.size() / 2, std::size_t{1}, std::size_t{0}}) {
    write("cut_off.json", text.substr(0, bytes));
    expect_refused("fuzz --merge 1.json 2.json cut_off.json", {"cut_off.json", "incomplete"});
  }
  for (const char* bad : {"{}", "[]", "1", R"({"format": "cutproof.fuzz", "format_version": 3})"}) {
    write("bad.json", bad);
    expect_refused("fuzz --merge bad.json", {"bad.json"});
  }
  json other_version = result("3.json");
  for (const int version : {3, 5}) {
    other_version["format_version"] = version;
    write("other.json", other_version.dump());
    expect_refused("fuzz --merge 1.json other.json", {"other.json", "format_version", std::to_string(version),
                                                      "only 4 is read", "run the campaign again"});
  }
  // What says that it is no shard: 4 of 3, 0 of 3, 1 of 0, or more than any machine has.
  for (const auto& [shard, shards] : {std::pair{4, 3}, {0, 3}, {1, 0}, {1, 2'000'000'000}}) {
    json none = result("3.json");
    none["shard"] = shard;
    none["shards"] = shards;
    write("none_of_them.json", none.dump());
    expect_refused("fuzz --merge none_of_them.json", {"none_of_them.json", "there is no shard"});
  }
  // Numbers that no integer holds.
  for (const auto& [field, value] :
       {std::pair{"shard", json(1e300)}, {"shards", json(2.5)}, {"sizes", json{0, 1e20}}}) {
    json none = result("3.json");
    none[field] = value;
    write("none_of_them.json", none.dump());
    expect_refused("fuzz --merge none_of_them.json", {"none_of_them.json", "not a whole number"});
  }
  // Whatever is missing, or of another kind: a result that is refused, and no defect of the program.
  const json third = result("3.json");
  for (const auto& [field, value] : third.items()) {
    for (const bool is_there : {false, true}) {
      json broken = third;
      broken.erase(field);
      if (is_there) broken[field] = value.is_object() ? json{{"x", "y"}} : json{{"x"}};
      write("broken.json", broken.dump());
      const Outcome outcome = cutproof("fuzz --merge 1.json 2.json broken.json");
      // The machine's threads, and a verdict that merging makes itself, are not read.
      const bool is_read = field != "threads" && field != "mean_particles" && field != "holds";
      EXPECT_EQ(outcome.status, is_read ? 2 : 0) << field << is_there << "\n" << outcome.output;
      EXPECT_EQ(outcome.output.find("broken.json") != std::string::npos, is_read) << outcome.output;
    }
  }
  // What was merged is no shard: an incomplete result would become a complete one.
  expect_refused("fuzz --merge merged.json", {"merged.json", "merged already"});
  expect_refused("fuzz --merge 1.json 2.json 3.json --json nowhere/f.json", {"nowhere"});

  // A shard that failed makes the whole fail.
  json failed = result("3.json");
  failed["violations"] = json::array({{{"index", 2}, {"text", "'coverage' fails"}, {"file", "x.json"}}});
  write("failed.json", failed.dump());
  const Outcome fails = cutproof("fuzz --merge 1.json 2.json failed.json");
  EXPECT_EQ(fails.status, 1);
  EXPECT_NE(fails.output.find("'coverage' fails"), std::string::npos);
}

// A shard that is lost costs its cases and is named; what is left neither fails as bad input nor passes.
TEST_F(Fuzz, NamesShardsThatAreMissing) {
  for (const std::string shard : {"1", "3", "6"}) {
    ASSERT_EQ(
        cutproof("fuzz --backend reference --cases 100 --sizes 0-40 --shard " + shard + "/9 --json " + shard + ".json")
            .status,
        0);
  }
  const Outcome merged = cutproof("fuzz --merge 1.json 3.json 6.json --json merged.json");
  EXPECT_EQ(merged.status, 1) << merged.output;
  EXPECT_NE(merged.output.find("INCOMPLETE: missing 2,4-5,7-9;"), std::string::npos) << merged.output;
  EXPECT_NE(merged.output.find("FAILS: of 9 shards"), std::string::npos) << merged.output;
  EXPECT_EQ(merged.output.find("all hold"), std::string::npos) << merged.output;
  json document = result("merged.json");
  EXPECT_EQ(document["complete"], false);
  EXPECT_EQ(document["missing_shards"], (json{2, 4, 5, 7, 8, 9}));
  EXPECT_EQ(document["merged_shards"], 9);
  EXPECT_EQ(document["holds"], false);
  EXPECT_EQ(document["violations"], json::array());
  EXPECT_EQ(document["cases"], 12 + 11 + 11);

  // What fails is said as well, by index whatever the order of the files.
  for (const auto& [shard, index] : {std::pair{"3", 11}, {"6", 5}}) {
    document = result(std::string(shard) + ".json");
    document["violations"] = {{{"index", index},
                               {"property", "coverage"},
                               {"stage", "split"},
                               {"text", "'coverage' fails"},
                               {"witness", ""},
                               {"file", "x.json"}}};
    write(std::string(shard) + ".json", document.dump());
  }
  const Outcome failing = cutproof("fuzz --merge 3.json 6.json --json merged.json");
  EXPECT_EQ(failing.status, 1) << failing.output;
  EXPECT_NE(failing.output.find("FAILS: 2 of 22 cases; of 9 shards"), std::string::npos) << failing.output;
  document = result("merged.json");
  EXPECT_EQ(document["violations"][0]["index"], 5);
  EXPECT_EQ(document["violations"][1]["index"], 11);
}

// The plugin is the reference, but for the first particle of each removal, which stays.
TEST_F(Fuzz, KeepsCasesAsTheyWereDrawnWhereNoTimeIsLeftToSimplifyThem) {
  const std::string wrong = "fuzz --backend plugin:" CUTPROOF_PLUGIN_OF_THE_REFERENCE ",detect --sizes 0-20 --seed 7 ";
  const Outcome late = cutproof(wrong + "--seconds 2 --keep-going --json late.json");
  EXPECT_EQ(late.status, 1) << late.output;
  const json violations = result("late.json").at("violations");
  ASSERT_FALSE(violations.empty()) << late.output;
  for (const json& violation : violations) {
    EXPECT_FALSE(violation.contains("shrunk") || violation.contains("drawn")) << violation;
    const Counterexample kept = counterexample_from_json(read(violation.at("file")), violation.at("file"));
    EXPECT_EQ(kept.index, violation.at("index"));
    const int size = static_cast<int>(kept.index % 21);
    EXPECT_EQ(kept.failing, draw_case(7 + static_cast<uint64_t>(kept.index), size));
  }
  // What it says brings the same case, with time to shrink it.
  const auto index = violations.front().at("index").get<int64_t>();
  const std::string options = "--seed " + std::to_string(7 + index) + " --sizes " + std::to_string(index % 21) + "-" +
                              std::to_string(index % 21) + " --cases 1";
  EXPECT_NE(on_one_line(late.output).find(options), std::string::npos) << late.output;
  const Outcome again = cutproof("fuzz --backend plugin:" CUTPROOF_PLUGIN_OF_THE_REFERENCE ",detect " + options +
                                 " --shrink 1 --json again.json");
  EXPECT_EQ(again.status, 1) << again.output;
  EXPECT_TRUE(result("again.json").at("violations").at(0).contains("shrunk")) << again.output;
}

TEST_F(Fuzz, RefusesDevicesOfABackendThatNeedsNone) {
  for (const char* devices : {"0", "all", "nonsense"}) {
    expect_refused(std::string("fuzz --backend host --devices ") + devices, {"--devices", "no device", "gpu"});
  }
}

TEST_F(Fuzz, OnAllDevicesJudgesWhatOneDoesAndRefusesDevicesThatAreNotThere) {
  const Outcome on_a_device = cutproof("fuzz --backend gpu --cases 1");
  if (on_a_device.status != 0) GTEST_SKIP() << "there is no device here: " << on_a_device.output;
  expect_refused("fuzz --backend gpu --devices 1000", {"--devices", "no device 1000", "all"});
  expect_refused("fuzz --backend gpu --devices 0,0", {"--devices", "0", "twice"});
  for (const char* devices : {"0,", ",0", "a", "-1", "0-1"}) {
    expect_refused(std::string("fuzz --backend gpu --devices ") + devices, {"--devices", "no list"});
  }
  const Outcome all = cutproof("fuzz --backend gpu --devices all --cases 200 --seed 7 --json all.json");
  EXPECT_EQ(all.status, 0) << all.output;
  EXPECT_EQ(cutproof("fuzz --backend gpu --cases 200 --seed 7 --json one.json").status, 0);
  for (const char* field : {"cases", "particles", "coverage", "batch"}) {
    EXPECT_EQ(result("all.json").at(field), result("one.json").at(field)) << field;
  }
  EXPECT_EQ(result("all.json").at("devices").at(0), 0);
}

TEST_F(Fuzz, RefusesBadUsage) {
  expect_refused("fuzz --backend nobody", {"--backend", "nobody", "simulated"});
  expect_refused("fuzz --sizes 5", {"--sizes", "0-79"});
  expect_refused("fuzz --sizes 9-5", {"--sizes"});
  expect_refused("fuzz --sizes 5-111", {"--sizes"});
  expect_refused("fuzz --shard 0/3", {"--shard", "2/8"});
  expect_refused("fuzz --shard 4/3", {"--shard"});
  expect_refused("fuzz --shard 1/1000001", {"--shard", "1000000"});
  expect_refused("fuzz --cases -1", {"--cases"});
  write("file", "");
  expect_refused("fuzz --save file/nowhere", {"--save", "file/nowhere"});
  expect_refused("fuzz --json nowhere/f.json", {"nowhere"});
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
}  // namespace fuzz_test
