// Results of a run or a check, of which a page is made.
#include "report/results.h"

#include <nlohmann/json.hpp>

#include "model/io/json_reader.h"
#include "model/io/limits.h"
#include "report/documents.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_results {

// A campaign, a measurement.
void feed_document(const nlohmann::json& document, const std::string& file) {
  const report::Sheet sheet = report::sheet_of(document, file);
  if (sheet.summary.empty() || sheet.badge.empty()) broken_contract("there is nothing to say");
  if (sheet.cards.size() > report::kMostCards) broken_contract("more failures are shown than there may be");
  if (sheet.holds.value_or(false) && sheet.kind != "benchmark" && !sheet.cards.empty())
    broken_contract("what has failures holds");
  const nlohmann::json shown = report::to_json(sheet);
  for (const nlohmann::json& piece : shown.at("pieces")) {
    if (piece.at("kind") != "grid") continue;
    for (const nlohmann::json& row : piece.at("rows")) {
      if (row.at("cells").size() != piece.at("columns").size())
        broken_contract("a row has other columns than its table");
    }
  }
}

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    write_scratch("results.json", bytes);
    const std::string file = scratch_path("results.json");
    const nlohmann::json document = io::read_json(file, io::kResultsLimits, "Give a result.");
    if (const report::DocumentKind kind = report::kind_of(document, file);
        kind != report::DocumentKind::run && kind != report::DocumentKind::counterexample) {
      return feed_document(document, file);
    }
    const report::Results results = report::read_results(scratch_path("results.json"));
    int64_t failed = 0;
    for (const report::PropertyRow& row : results.rows) {
      failed += row.failed;
      if (row.failed + row.expected > row.judged) broken_contract("more verdicts fail than were judged");
    }
    if (results.holds && failed > 0) broken_contract("failures hold");
    if (results.findings.size() > report::kMostFindings) broken_contract("more failures are shown than there may be");
    if (report::summary_sentence(results).empty()) broken_contract("there is nothing to say");
  });
}

nlohmann::json verdict(const std::string& property, bool holds) {
  nlohmann::json one = {{"property", property}, {"stage", "split"},  {"backend", "host"},
                        {"frame", 3},           {"body", 0},         {"holds", holds},
                        {"measured", 0.5},      {"bound", "inf"},    {"unit", "h"},
                        {"checked", 7},         {"inconclusive", 2}, {"bound_source", "a page"}};
  if (!holds)
    one["witness"] = {
        {"text", "there"}, {"clusters", {1}}, {"particles", {2, 3}}, {"path", {2, 4, 3}}, {"triangles", {0, 1}}};
  return one;
}

std::vector<std::string> seeds() {
  nlohmann::json run = {{"format", "cutproof.run"},
                        {"format_version", 2},
                        {"cutproof", "0.1.0"},
                        {"scene", "cut"},
                        {"backend", "host"},
                        {"body", {{"particles", 10}}},
                        {"frames", {{{"frame", 0}, {"seconds", {{"step", 0.1}, {"skin", 0.2}}}}}},
                        {"checked", true},
                        {"verdicts", {verdict("coverage", true), verdict("split exactness", false)}},
                        {"properties", {{{"property", "coverage"}, {"stage", "split"}}}},
                        {"summary", {{"holds", false}}},
                        {"notes", {"a note"}},
                        {"not_reached", {"the end"}}};
  nlohmann::json check = run;
  check["format"] = "cutproof.check";
  check["checked"] = false;
  run["against"] = {{"verdicts", {verdict("lockstep: positions", true)}},
                    {"lockstep", {{"frames", {{"frame", {0}}, {"position_max", {1e-7}}}}}},
                    {"free_running", nullptr}};
  run["errors"] = {{"solver", {{"frames", {{{"frame", 0}, {"max", 0.1}}}}}}, {"time_step", {{"rms", {0.1, nullptr}}}}};
  const nlohmann::json property = {{"property", "coverage"}, {"stage", "split"}, {"unit", "1"},       {"judged", 3},
                                   {"checked", 9},           {"failed", 1},      {"inconclusive", 2}, {"measured", 1},
                                   {"of_bound", nullptr}};
  const nlohmann::json campaign = {{"format", "cutproof.fuzz"},
                                   {"format_version", 4},
                                   {"cutproof", "0.1.0"},
                                   {"backend", "host"},
                                   {"dynamics", true},
                                   {"complete", true},
                                   {"cases", 10},
                                   {"verdicts", 30},
                                   {"refused", 1},
                                   {"mean_particles", 12.5},
                                   {"seed", 7},
                                   {"sizes", {0, 79}},
                                   {"seconds", 0.5},
                                   {"shard", 1},
                                   {"shards", 1},
                                   {"properties", {property}},
                                   {"coverage", {{"boxes", 3}, {"merge", 0}}},
                                   {"holds", false},
                                   {"left_to_reference", {"skin"}},
                                   {"violations",
                                    {{{"index", 3},
                                      {"property", "coverage"},
                                      {"stage", "split"},
                                      {"text", "all of it"},
                                      {"file", "a.json"},
                                      {"drawn", {{"particles", 90}, {"strokes", 4}}},
                                      {"shrunk", {{"particles", 2}, {"strokes", 1}}}}}}};
  const nlohmann::json times = {{"median", 0.002}, {"min", 0.001}, {"max", 0.003}};
  const nlohmann::json head = {
      {"format", "cutproof.bench"}, {"format_version", 3}, {"cutproof", "0.1.0"}, {"backend", "host"},
      {"device", "a CPU"},          {"date", "today"},     {"complete", true}};
  nlohmann::json limits = head;
  limits.update({{"suite", "machine_limits"},
                 {"holds", true},
                 {"rows", {{{"what", "copy"}, {"seconds", times}, {"bytes_per_second", 1e9}, {"lost", 0}}}}});
  nlohmann::json tune = head;
  const nlohmann::json trial = {{"substeps", 4},
                                {"iterations", 2},
                                {"acceleration", "none"},
                                {"differences", ""},
                                {"outcome", "within"},
                                {"why", ""},
                                {"rms_h", 0.01},
                                {"max_h", 0.02},
                                {"rms_h_by_frame", {0.001, 0.01}},
                                {"removed_otherwise", 0},
                                {"seconds_per_frame", times}};
  tune.update(
      {{"suite", "tune"},
       {"scene", "a.json"},
       {"tolerance_h", 0.1},
       {"reference", {{"kind", "limit"}, {"levels", nlohmann::json::array()}, {"known_text", "known"}}},
       {"front", nlohmann::json::array()},
       {"trials", {trial}},
       {"left", nlohmann::json::array()},
       {"found",
        {{"trial", 0}, {"verified", trial}, {"verdicts", 9}, {"seconds_per_frame", times}, {"times_cheaper", 1.0}}}});
  return {run.dump(), check.dump(), campaign.dump(), limits.dump(), tune.dump()};
}

}  // namespace of_results

const Target kResults = {"results", of_results::feed, of_results::seeds};

}  // namespace cutproof::input_fuzzing
