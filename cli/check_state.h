// `cutproof check` of a file of arrays: one state of another simulator.
#pragma once
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/baseline.h"
#include "cli/findings.h"
#include "cli/terminal.h"
#include "harness/foreign_judge.h"
#include "model/io/array_file.h"

namespace cutproof::cli {

struct StateReports {
  std::string json, junit, page;  // files; empty: none
  std::string again;              // the command line
  std::string baseline = {};      // a file; empty: none
  std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
};

nlohmann::json not_judged_json(const std::vector<harness::NotJudged>& not_judged);

// For a judged file: writes JUnit, with properties of the whole, and prints the verdicts and the properties that were
// not judged. `since`: beside a baseline, or null.
void show_judged(const std::vector<Verdict>& verdicts, const std::vector<harness::NotJudged>& not_judged,
                 const std::vector<std::string>& notes, const Shown& shown, const Judging& judging,
                 const StateReports& reports, const std::vector<std::pair<std::string, std::string>>& properties = {},
                 const SinceBaseline* since = nullptr);

// Judges, prints, and writes the requested files. `contents`: of the file. Returns the exit status.
int check_state(const io::ArrayFile& contents, const std::string& file, const StateReports& reports);

}  // namespace cutproof::cli
