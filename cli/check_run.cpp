#include "cli/check_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "harness/foreign_run.h"
#include "harness/run_states.h"
#include "model/counted.h"
#include "model/io/atomic_file.h"
#include "model/io/verdict_json.h"
#include "report/page.h"

namespace cutproof::cli {

namespace {

// "At the end the blade has made 2 pieces (48 and 36 particles), and the simulator couples 1 body."; of many, the
// largest.
std::string in_words(const oracles::RunPieces& pieces) {
  if (pieces.units == 0) return "The run has no tissue that pieces could be told of.";
  std::string sizes;
  for (std::size_t k = 0; k < std::min<std::size_t>(pieces.sizes.size(), 5); ++k) {
    sizes += (k == 0 ? "" : k + 1 == pieces.sizes.size() ? " and " : ", ") + std::to_string(pieces.sizes[k]);
  }
  if (pieces.sizes.size() > 5) sizes += ", …";
  const bool is_one = pieces.sizes.size() == 1 && pieces.sizes[0] == 1;
  std::string text = fmt::format(
      "{} {} ({} {})", pieces.pieces > pieces.at_first ? "At the end the blade has made" : "At the end the tissue is",
      counted(pieces.pieces, "piece", "pieces"), sizes,
      std::string(pieces.of_cells ? "cell" : "particle") + (is_one ? "" : "s"));
  const bool is_open = pieces.at_most > pieces.pieces;
  if (is_open)
    text +=
        fmt::format(". How it parts tissue that it only touches is open: up to {} pieces are right", pieces.at_most);
  if (pieces.coupled > 0)
    text += fmt::format("{} simulator couples {}", is_open ? ". The" : ", and the",
                        counted(pieces.coupled, "body", "bodies"));
  return text + ".";
}

nlohmann::json to_json(const std::string& file, const harness::JudgedRun& judged) {
  const auto failed =
      std::count_if(judged.verdicts.begin(), judged.verdicts.end(), [](const Verdict& v) { return !v.holds; });
  const oracles::RunPieces& pieces = judged.pieces;
  return {{"format", "cutproof.check_run"},
          {"format_version", 1},
          {"cutproof", kVersion},
          {"source", file},
          {"run",
           {{"frames", judged.frames},
            {"segments", judged.segments},
            {"particles_at_start", judged.particles_at_start},
            {"particles_at_end", judged.particles_at_end}}},
          {"pieces",
           {{"units", pieces.units},
            {"sure", pieces.pieces},
            {"at_most", pieces.at_most},
            {"sizes", pieces.sizes},
            {"edges_surely_cut", pieces.surely_cut},
            {"edges_perhaps_cut", pieces.perhaps_cut},
            {"beside_the_cut", pieces.beside},
            {"coupled", pieces.coupled},
            {"last_cut", pieces.last_cut < 0 ? nlohmann::json() : nlohmann::json(pieces.last_cut)},
            {"in_words", in_words(pieces)}}},
          {"arrays", judged.given},
          {"single_precision", judged.single_precision},
          {"verdicts", io::verdicts_json(judged.verdicts, false)},
          {"not_judged", not_judged_json(judged.not_judged)},
          {"summary", {{"holds", judged.holds()}, {"verdicts", judged.verdicts.size()}, {"failed", failed}}},
          {"notes", judged.notes}};
}

void write_page_of(const std::string& file, const harness::JudgedRun& judged, harness::PiecesOverTime& pieces,
                   const nlohmann::json& document, const StateReports& reports) {
  harness::RunStates states([&] { return io::RunSegments::of(file); }, judged);
  const auto particles = static_cast<int32_t>(judged.particles_at_end);
  const report::Source source = {
      states.setup(), judged.frames,
      [&](int64_t frame) {
        return io::Snapshot{Stage::skin, states.after(frame)};
      },
      [&](int64_t frame) {
        const State& state = states.after(frame);
        report::FrameOfRun of_run = {pieces.after(frame, particles), states.swept(), states.time()};
        for (std::size_t i = 0; i < state.alive.size(); ++i) {
          if (state.alive[i] == 0) of_run.piece[i] = -1;
        }
        return of_run;
      }};
  io::write_text(reports.page, report::page(source, report::results_of(document, reports.page), reports.again,
                                            made_by(reports.again)));
}

}  // namespace

int check_run(io::RunSegments segments, const std::string& file, const StateReports& reports) {
  require_writable(reports.json);
  require_writable(reports.junit);
  require_report(reports.page);
  const std::optional<Baseline> baseline = read_baseline(reports.baseline, {"cutproof.check_run"});
  harness::PiecesOverTime pieces;
  const harness::JudgedRun judged = [&] {
    Progress progress("frame", 0);
    return harness::judge_run(std::move(segments), [&](int64_t frame, const oracles::RunJudge& judge) {
      if (!reports.page.empty()) pieces.add(judge.piece_of_particles());
      progress.show(frame + 1, "judging");
    });
  }();
  nlohmann::json document = to_json(file, judged);
  const std::optional<SinceBaseline> since = since_baseline(baseline, document);
  write_document(reports.json, document);
  if (!reports.page.empty()) write_page_of(file, judged, pieces, document, reports);
  const Judging judging{"cutproof check", class_of("check", "run"), reports.again, Judging::Of::frames};
  say("run {}: {} frames of {} particles. {}\n", file, judged.frames, judged.particles_at_end, in_words(judged.pieces));
  Shown shown{reports.again};
  shown.in_stages = false;
  show_judged(judged.verdicts, judged.not_judged, judged.notes, shown, judging, reports, {}, since ? &*since : nullptr);
  return judged.holds() || (since && since->excuses()) ? 0 : 1;
}

}  // namespace cutproof::cli
