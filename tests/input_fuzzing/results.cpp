// Results of a run or a check, of which a page is made.
#include "report/results.h"

#include <nlohmann/json.hpp>

#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace {

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    write_scratch("results.json", bytes);
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
  nlohmann::json one = {{"property", property}, {"stage", "split"}, {"backend", "host"},
                        {"frame", 3},           {"body", 0},        {"holds", holds},
                        {"measured", 0.5},      {"bound", "inf"},   {"unit", "h"},
                        {"checked", 7},         {"undecided", 2},   {"bound_source", "a page"}};
  if (!holds) one["witness"] = {{"text", "there"}, {"clusters", {1}}, {"particles", {2, 3}}, {"path", {2, 4, 3}}, {"triangles", {0, 1}}};
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
  return {run.dump(), check.dump()};
}

}  // namespace

const Target kResults = {"results", feed, seeds};

}  // namespace cutproof::input_fuzzing
