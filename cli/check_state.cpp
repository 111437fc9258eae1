#include "cli/check_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/output.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "harness/foreign_judge.h"
#include "model/io/array_file.h"
#include "model/io/atomic_file.h"
#include "model/io/verdict_json.h"
#include "report/pieces.h"

namespace cutproof::cli {

namespace {

nlohmann::json to_json(const std::string& file, const harness::ForeignState& foreign,
                       const harness::ForeignVerdicts& judged) {
  nlohmann::json promises = nlohmann::json::array();
  for (std::size_t k = 0; k < harness::promise_words().size(); ++k) {
    if ((foreign.promises.words >> k & 1u) != 0) promises.push_back(harness::promise_words()[k].name);
  }
  const auto failed = std::count_if(judged.verdicts.begin(), judged.verdicts.end(),
                                    [](const Verdict& verdict) { return !verdict.holds; });
  return {{"format", "cutproof.check_state"},
          {"format_version", 1},
          {"cutproof", kVersion},
          {"source", file},
          {"body",
           {{"particles", foreign.state.x.size()},
            {"clusters", foreign.state.clusters.count()},
            {"spacing", foreign.setup.body.grid.spacing},
            {"on_grid", foreign.setup.body.on_grid()},
            {"pieces", judged.pieces ? nlohmann::json(*judged.pieces) : nlohmann::json()},
            {"coincident_particles", judged.coincident}}},
          {"weights", foreign.plain_weights ? "plain" : "shared"},
          {"arrays", foreign.given},
          {"promises", promises},
          {"promises_given", foreign.promises_given},
          {"single_precision", foreign.state.precision == Precision::binary32},
          {"verdicts", io::verdicts_json(judged.verdicts, false)},
          {"not_judged", not_judged_json(judged.not_judged)},
          {"summary", {{"holds", judged.holds()}, {"verdicts", judged.verdicts.size()}, {"failed", failed}}},
          {"notes", judged.notes}};
}

// A single moment. Of a state that is none no moment is shown, of one that is not well formed no pieces.
void write_page_of(const harness::ForeignState& foreign, const harness::ForeignVerdicts& judged,
                   const nlohmann::json& document, const StateReports& reports) {
  const Body& body = foreign.setup.body;
  State state = foreign.state;
  state.frame = 1;
  const auto n = static_cast<std::size_t>(body.particle_count());
  const bool is_state = foreign.defect.empty() && state.x.size() == n && state.alive.size() == n;
  const std::vector<int32_t> piece =
      judged.pieces ? report::pieces_of(body, state.alive).of : std::vector<int32_t>(n, -1);
  const report::Source source = {foreign.setup, is_state ? 1 : 0,
                                 [&](int64_t) {
                                   return io::Snapshot{Stage::skin, state};
                                 },
                                 [&](int64_t) {
                                   return report::FrameOfRun{piece, {}, std::nullopt};
                                 }};
  io::write_text(reports.page, report::page(source, report::results_of(document, reports.page), reports.again,
                                            made_by(reports.again)));
}

}  // namespace

nlohmann::json not_judged_json(const std::vector<harness::NotJudged>& not_judged) {
  nlohmann::json all = nlohmann::json::array();
  for (const harness::NotJudged& each : not_judged) all.push_back({{"property", each.property}, {"why", each.why}});
  return all;
}

void show_judged(const std::vector<Verdict>& verdicts, const std::vector<harness::NotJudged>& not_judged,
                 const std::vector<std::string>& notes, const Shown& shown, const Judging& judging,
                 const StateReports& reports, const std::vector<std::pair<std::string, std::string>>& properties,
                 const SinceBaseline* since) {
  std::vector<io::JunitCase> cases = cases_of(verdicts, judging);
  std::vector<std::pair<std::string, std::string>> others;
  for (const harness::NotJudged& each : not_judged) {
    others.emplace_back(each.property, each.why);
    cases.push_back({each.property, judging.class_name, 0, io::JunitOutcome::skipped, "not judged: " + each.why});
  }
  if (since != nullptr) excuse_known(*since, cases);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - reports.begun;
  write_junit(reports.junit, judging, seconds.count(), std::move(cases), properties);
  print_verdicts(verdicts, shown);
  print_grouped(unsettled("Not judged"), others);
  print_notes(notes);
  print_written(reports.json);
  print_written(reports.page);
  print_conclusion(verdicts, shown, "what was judged holds.");
  if (since != nullptr) print_since(*since);
  ForGitHub said = {judging.again, failures_of(verdicts, judging, [&](const Verdict& verdict) {
                      return since != nullptr && since->is_known(verdict, judging.in_stages());
                    })};
  if (since != nullptr) add_baseline_to(said, *since);
  tell_github(said);
}

int check_state(const io::ArrayFile& contents, const std::string& file, const StateReports& reports) {
  const harness::ForeignState foreign = harness::foreign_state_of(contents, file);
  require_writable(reports.json);
  require_writable(reports.junit);
  require_report(reports.page);
  const std::optional<Baseline> baseline = read_baseline(reports.baseline, {"cutproof.check_state"});
  const harness::ForeignVerdicts judged = harness::judge_foreign_state(foreign);
  nlohmann::json document = to_json(file, foreign, judged);
  const std::optional<SinceBaseline> since = since_baseline(baseline, document);
  write_document(reports.json, document);
  if (!reports.page.empty()) write_page_of(foreign, judged, document, reports);
  const Judging judging{"cutproof check", class_of("check", "state"), reports.again, Judging::Of::state};
  say("state {}: {} particles in {} clusters, {}{}\n", file, foreign.state.x.size(), foreign.state.clusters.count(),
      foreign.given.contains("nodes") ? "on a grid" : "as a graph", judged.pieces ? "; " + judged.pieces_in_words : "");
  Shown shown{reports.again};
  shown.in_frames = false;
  show_judged(judged.verdicts, judged.not_judged, judged.notes, shown, judging, reports, {}, since ? &*since : nullptr);
  return judged.holds() || (since && since->excuses()) ? 0 : 1;
}

}  // namespace cutproof::cli
