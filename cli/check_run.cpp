#include "cli/check_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "harness/foreign_run.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli {

namespace {

nlohmann::json to_json(const std::string& file, const harness::JudgedRun& judged) {
  nlohmann::json not_judged = nlohmann::json::array();
  for (const auto& each : judged.not_judged) not_judged.push_back({{"property", each.property}, {"why", each.why}});
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
            {"coupled", pieces.coupled}}},
          {"arrays", judged.given},
          {"single_precision", judged.single_precision},
          {"verdicts", io::verdicts_json(judged.verdicts)},
          {"not_judged", not_judged},
          {"summary", {{"holds", judged.holds()}, {"verdicts", judged.verdicts.size()}, {"failed", failed}}},
          {"notes", judged.notes}};
}

// "2 pieces of 60 and 60 particles by the blade's sweep"; of many, the largest.
std::string in_words(const oracles::RunPieces& pieces) {
  if (pieces.units == 0) return "the run has no tissue that pieces could be told of";
  std::string sizes;
  for (std::size_t k = 0; k < std::min<std::size_t>(pieces.sizes.size(), 5); ++k) {
    sizes += (k == 0 ? "" : ", ") + std::to_string(pieces.sizes[k]);
  }
  if (pieces.sizes.size() > 5) sizes += ", …";
  std::string text =
      fmt::format("{} {} by the blade's sweep ({})", pieces.pieces, pieces.pieces == 1 ? "piece" : "pieces", sizes);
  if (pieces.at_most > pieces.pieces) text += fmt::format(", perhaps {}", pieces.at_most);
  if (pieces.coupled > 0) text += fmt::format("; {} coupled", pieces.coupled);
  return text;
}

}  // namespace

int check_run(io::RunSegments& segments, const std::string& file, const StateReports& reports) {
  require_writable(reports.json);
  require_writable(reports.junit);
  const harness::JudgedRun judged = [&] {
    Progress progress("frame", 0);
    return harness::judge_run(segments, [&](int64_t frame) { progress.show(frame + 1, "judging"); });
  }();
  write_document(reports.json, to_json(file, judged));
  const Judging judging{"cutproof check", "cutproof.check.run", reports.again};
  say("run {}: {} frames of {} particles; {}\n", file, judged.frames, judged.particles_at_end, in_words(judged.pieces));
  Shown shown{reports.again};
  shown.in_stages = false;
  show_judged(judged.verdicts, judged.not_judged, judged.notes, shown, judging, reports);
  return judged.holds() ? 0 : 1;
}

}  // namespace cutproof::cli
