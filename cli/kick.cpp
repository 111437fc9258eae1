// `cutproof kick`: whether kicks of a piece are felt by another, of a simulator that is known by its positions alone.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "cli/check_state.h"
#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/kick_page.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "harness/recorded_kick.h"
#include "model/at.h"
#include "model/io/array_file.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli {

namespace {

struct KickOptions {
  std::string file;
  std::string json, junit, report;
  std::string again;  // the command line
};

// What a reader of the verdicts has to know.
std::vector<std::string> notes_of(const oracles::KickReport& report, const harness::RecordedKick& kick) {
  const oracles::KickedRuns& runs = kick.runs;
  std::vector<std::string> notes = kick.notes;
  if (runs.again.empty()) {
    notes.push_back("Without again, the simulator is taken to repeat itself to the last bit.");
  } else if (!report.repeats) {
    std::string note = "The simulator does not repeat itself, so the test is blunt";
    const auto bluntest = std::max_element(
        report.kicks.begin(), report.kicks.end(),
        [](const oracles::KickAnswer& a, const oracles::KickAnswer& b) { return a.least_bound < b.least_bound; });
    if (bluntest != report.kicks.end() && bluntest->sharpest_frame >= 0) {
      note += fmt::format(
          ": a push of less than {:.3g} m passes in frame {}, where it is sharpest and the kicked piece "
          "is off by {:.3g} m",
          bluntest->least_bound, bluntest->sharpest_frame, bluntest->kick_then);
    }
    notes.push_back(note + ".");
    if (report.judged_frames < runs.frames) {
      notes.push_back(
          fmt::format("The noise of again begins late, and that of kicked may have begun at once. From frame {} on "
                      "nobody knows how far it would have grown: nothing was judged there.",
                      report.judged_frames));
    }
  }
  if (runs.tolerance > 0) {
    notes.push_back(fmt::format("Other pieces may feel {:g} of a kick: tolerance.", runs.tolerance));
  }
  return notes;
}

nlohmann::json figure_or_null(bool there, double value) { return there ? json_number(value) : nlohmann::json(); }
nlohmann::json index_or_null(int64_t value) { return value >= 0 ? nlohmann::json(value) : nlohmann::json(); }

nlohmann::json to_json(const harness::RecordedKick& kick, std::size_t number, const oracles::KickAnswer& answer) {
  const bool was_felt = answer.kick_frame >= 0;
  nlohmann::json pieces = nlohmann::json::array();
  for (const oracles::KickedPiece& piece : answer.pieces) {
    const bool timed = piece.first_frame >= 0 && !kick.time.empty();
    pieces.push_back({{"piece", piece.piece},
                      {"particles", piece.particles},
                      {"felt", piece.felt},
                      {"greatest", json_number(piece.greatest)},
                      {"centre", json_number(piece.centre)},
                      {"of_kick", figure_or_null(was_felt, piece.of_kick)},
                      {"first_frame", index_or_null(piece.first_frame)},
                      {"first_time", figure_or_null(timed, timed ? kick.time[at(piece.first_frame)] : 0)}});
  }
  const oracles::KickedRun& run = kick.runs.kicks[number];
  nlohmann::json direction;
  if (run.direction) direction = {run.direction->x, run.direction->y, run.direction->z};
  const bool sharp = answer.sharpest_frame >= 0;
  return {{"direction", direction},
          {"equal", index_or_null(run.equal)},
          {"kicked_piece", answer.kicked_piece ? nlohmann::json(*answer.kicked_piece) : nlohmann::json()},
          {"kick_frame", index_or_null(answer.kick_frame)},
          {"least_bound", figure_or_null(sharp, answer.least_bound)},
          {"sharpest_frame", index_or_null(answer.sharpest_frame)},
          {"kick_then", figure_or_null(sharp, answer.kick_then)},
          {"pieces", pieces}};
}

nlohmann::json to_json(const KickOptions& options, const harness::RecordedKick& kick,
                       const oracles::KickReport& report) {
  nlohmann::json kicks = nlohmann::json::array(), verdicts = io::verdicts_json(report.verdicts, false);
  for (std::size_t k = 0; k < report.kicks.size(); ++k) {
    kicks.push_back(to_json(kick, k, report.kicks[k]));
    for (nlohmann::json verdict : io::verdicts_json(report.kicks[k].verdicts, false)) {
      verdict["kick"] = k;
      verdicts.push_back(std::move(verdict));
    }
  }
  const auto failed =
      std::count_if(verdicts.begin(), verdicts.end(), [](const auto& verdict) { return !verdict.at("holds"); });
  return {{"format", "cutproof.kick"},
          {"format_version", 2},
          {"cutproof", kVersion},
          {"source", options.file},
          {"frames", kick.runs.frames},
          {"particles", kick.runs.particles},
          {"repeats", kick.runs.again.empty() ? nlohmann::json() : nlohmann::json(report.repeats)},
          {"judged_frames", report.judged_frames},
          {"tolerance", kick.runs.tolerance},
          {"kicks", kicks},
          {"verdicts", verdicts},
          {"summary", {{"holds", report.holds()}, {"verdicts", verdicts.size()}, {"failed", failed}}},
          {"notes", notes_of(report, kick)}};
}

bool was_kicked(const oracles::KickAnswer& answer, const oracles::KickedPiece& piece) {
  return answer.kicked_piece && piece.piece == *answer.kicked_piece;
}

void print_pieces(const harness::RecordedKick& kick, const oracles::KickReport& report) {
  if (report.kicks.empty()) return;
  const bool several = report.kicks.size() > 1;
  std::vector<std::string> head = {"piece",      "particles",     "felt it",   "greatest [m]",
                                   "centre [m]", "felt / kicked", "from frame"};
  if (several) head.insert(head.begin(), "kick");
  Table table(head);
  for (std::size_t k = 0; k < report.kicks.size(); ++k) {
    const oracles::KickAnswer& answer = report.kicks[k];
    for (const oracles::KickedPiece& piece : answer.pieces) {
      std::string from = piece.first_frame < 0 ? "-" : fmt::format("{}", piece.first_frame);
      if (piece.first_frame >= 0 && !kick.time.empty()) {
        from += fmt::format(" ({:.4g} s)", kick.time[at(piece.first_frame)]);
      }
      const bool other = answer.kick_frame >= 0 && !was_kicked(answer, piece);
      if (was_kicked(answer, piece)) from += ", kicked";
      std::vector<std::string> row = {fmt::format("{}", piece.piece),
                                      fmt::format("{}", piece.particles),
                                      fmt::format("{}", piece.felt),
                                      fmt::format("{:.4g}", piece.greatest),
                                      fmt::format("{:.4g}", piece.centre),
                                      other ? fmt::format("{:.2g}", piece.of_kick) : "-",
                                      from};
      if (several) row.insert(row.begin(), fmt::format("{}", k));
      table.add(std::move(row));
    }
  }
  say_as_it_is("\n" + table.text(several ? 2 : 1));
}

// "felt / kicked": of each kick and each other piece.
std::vector<std::pair<std::string, std::string>> shares_of(const oracles::KickReport& report) {
  std::vector<std::pair<std::string, std::string>> shares;
  for (std::size_t k = 0; k < report.kicks.size(); ++k) {
    for (const oracles::KickedPiece& piece : report.kicks[k].pieces) {
      if (report.kicks[k].kick_frame < 0 || was_kicked(report.kicks[k], piece)) continue;
      shares.emplace_back(fmt::format("felt / kicked, kick {}, piece {}", k, piece.piece),
                          fmt::format("{:.3g}", piece.of_kick));
    }
  }
  return shares;
}

int kick(const KickOptions& options) {
  const harness::RecordedKick kick = harness::recorded_kick_of(io::read_array_file(options.file), options.file);
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  const StateReports reports = {options.json, options.junit, options.report, options.again};
  const oracles::KickReport report = oracles::judge_kick(kick.runs);
  const std::vector<Verdict> verdicts = report.all();
  const nlohmann::json document = to_json(options, kick, report);
  write_document(options.json, document);
  if (!options.report.empty()) write_kick_page(options.report, kick, report, document, options.again);
  const Judging judging{"cutproof kick", "cutproof.kick", options.again, Judging::Of::state};
  say("kick {}: {} frames of {} particles{}\n", options.file, kick.runs.frames, kick.runs.particles,
      kick.runs.kicks.size() > 1 ? fmt::format(", {} kicks", kick.runs.kicks.size()) : "");
  print_pieces(kick, report);
  Shown shown{options.again};
  shown.in_stages = false;
  show_judged(verdicts, {}, notes_of(report, kick), shown, judging, reports, shares_of(report));
  return report.holds() ? 0 : 1;
}

}  // namespace

void add_kick(CLI::App& program, Work& work) {
  const auto options = std::make_shared<KickOptions>();
  CLI::App* const command = program.add_subcommand("kick", "judge whether kicks of one piece move another");
  command->add_option("file", options->file, "NPZ or HDF5: the same simulation with and without kicks")
      ->required()
      ->type_name("FILE");
  add_json(*command, options->json, "write verdicts and what became of each piece");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return kick(*options); };
  });
}

}  // namespace cutproof::cli
