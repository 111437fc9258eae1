// `cutproof kick`: whether a kick of one piece is felt by another, of a simulator that is known by its positions alone.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "harness/recorded_kick.h"
#include "model/io/array_file.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli {

namespace {

struct KickOptions {
  std::string file;
  std::string json, junit;
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
    if (report.sharpest_frame >= 0) {
      note += fmt::format(
          ": a push of less than {:.3g} m passes in frame {}, where it is sharpest and the kicked piece "
          "is off by {:.3g} m",
          report.least_bound, report.sharpest_frame, report.kick_then);
    }
    notes.push_back(note + ".");
    if (report.judged_frames < runs.frames) {
      notes.push_back(
          fmt::format("The noise of again begins late, and that of kicked may have begun at once: how far it would "
                      "have grown is not "
                      "known from frame {} on, and nothing was judged there.",
                      report.judged_frames));
    }
  }
  return notes;
}

nlohmann::json to_json(const KickOptions& options, const harness::RecordedKick& kick,
                       const oracles::KickReport& report) {
  const auto figure_of = [](bool there, double value) { return there ? json_number(value) : nlohmann::json(); };
  nlohmann::json pieces = nlohmann::json::array();
  for (const oracles::KickedPiece& piece : report.pieces) {
    nlohmann::json entry = {{"piece", piece.piece},
                            {"particles", piece.particles},
                            {"felt", piece.felt},
                            {"greatest", json_number(piece.greatest)}};
    entry["first_frame"] = piece.first_frame >= 0 ? nlohmann::json(piece.first_frame) : nlohmann::json();
    const bool timed = piece.first_frame >= 0 && !kick.time.empty();
    entry["first_time"] = figure_of(timed, timed ? kick.time[static_cast<std::size_t>(piece.first_frame)] : 0);
    pieces.push_back(std::move(entry));
  }
  const auto failed = std::count_if(report.verdicts.begin(), report.verdicts.end(),
                                    [](const Verdict& verdict) { return !verdict.holds; });
  const bool sharp = report.sharpest_frame >= 0;
  return {{"format", "cutproof.kick"},
          {"format_version", 1},
          {"cutproof", kVersion},
          {"source", options.file},
          {"frames", kick.runs.frames},
          {"particles", kick.runs.particles},
          {"kicked_piece", report.kicked_piece ? nlohmann::json(*report.kicked_piece) : nlohmann::json()},
          {"kick_frame", report.kick_frame >= 0 ? nlohmann::json(report.kick_frame) : nlohmann::json()},
          {"repeats", kick.runs.again.empty() ? nlohmann::json() : nlohmann::json(report.repeats)},
          {"judged_frames", report.judged_frames},
          {"least_bound", figure_of(sharp, report.least_bound)},
          {"sharpest_frame", sharp ? nlohmann::json(report.sharpest_frame) : nlohmann::json()},
          {"kick_then", figure_of(sharp, report.kick_then)},
          {"pieces", pieces},
          {"verdicts", io::verdicts_json(report.verdicts)},
          {"summary", {{"holds", report.holds()}, {"verdicts", report.verdicts.size()}, {"failed", failed}}},
          {"notes", notes_of(report, kick)}};
}

void print_pieces(const harness::RecordedKick& kick, const oracles::KickReport& report) {
  if (report.pieces.empty()) return;
  Table table({"piece", "particles", "felt it", "greatest [m]", "from frame"});
  for (const oracles::KickedPiece& piece : report.pieces) {
    std::string from = piece.first_frame < 0 ? "-" : fmt::format("{}", piece.first_frame);
    if (piece.first_frame >= 0 && !kick.time.empty()) {
      from += fmt::format(" ({:.4g} s)", kick.time[static_cast<std::size_t>(piece.first_frame)]);
    }
    if (report.kicked_piece && piece.piece == *report.kicked_piece) from += ", kicked";
    table.add({fmt::format("{}", piece.piece), fmt::format("{}", piece.particles), fmt::format("{}", piece.felt),
               fmt::format("{:.4g}", piece.greatest), from});
  }
  say_as_it_is("\n" + table.text());
}

int kick(const KickOptions& options) {
  const harness::RecordedKick kick = harness::recorded_kick_of(io::read_array_file(options.file), options.file);
  require_writable(options.json);
  require_writable(options.junit);
  const oracles::KickReport report = oracles::judge_kick(kick.runs);
  write_document(options.json, to_json(options, kick, report));
  const Judging judging{"cutproof kick", "cutproof.kick", options.again};
  write_junit(options.junit, judging, 0, cases_of(report.verdicts, judging));
  say("kick {}: {} frames of {} particles\n", options.file, kick.runs.frames, kick.runs.particles);
  print_pieces(kick, report);
  Shown shown{options.again};
  shown.in_frames = false;
  print_verdicts(report.verdicts, shown);
  print_notes(notes_of(report, kick));
  print_written(options.json);
  print_conclusion(report.verdicts, shown, "what was judged holds.");
  print_annotations(failures_of(report.verdicts, judging));
  return report.holds() ? 0 : 1;
}

}  // namespace

void add_kick(CLI::App& program, Work& work) {
  const auto options = std::make_shared<KickOptions>();
  CLI::App* const command = program.add_subcommand("kick", "judge whether a kick of one piece moves another");
  command->add_option("file", options->file, "NPZ or HDF5: the same simulation with and without a kick")
      ->required()
      ->type_name("FILE");
  add_json(*command, options->json, "write verdicts and what became of each piece");
  add_junit(*command, options->junit);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return kick(*options); };
  });
}

}  // namespace cutproof::cli
