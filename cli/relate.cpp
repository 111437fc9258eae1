// `cutproof relate`: whether two runs of a simulator correspond as their inputs do, and what makes the second input.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/check_state.h"
#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/relate_page.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "harness/related_runs.h"
#include "model/io/array_file.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli {

namespace {

struct RelateOptions {
  std::vector<std::string> files;
  std::string map, make;
  std::vector<std::string> noise, dimensions;
  bool bits = false;
  std::string json, junit, report;
  std::string again;  // the command line
};

std::vector<std::string> notes_of(const harness::JudgedRelation& judged, bool has_noise) {
  std::vector<std::string> notes = judged.notes;
  if (judged.sharpest.frame >= 0) {
    notes.push_back(
        fmt::format("Sharpest in frame {}: more than {:.2g} m fails, where a particle has moved by {:.2g} m{}.",
                    judged.sharpest.frame, judged.sharpest.bound, judged.sharpest.moved,
                    has_noise ? "" : "; without --noise rounding is all that is allowed"));
  }
  for (std::size_t k = 0; k < judged.differences.size(); ++k) {
    notes.push_back(fmt::format("Run {} and the next differ by {:.3g} m.", k + 1, judged.differences[k]));
  }
  return notes;
}

nlohmann::json to_json(const RelateOptions& options, const harness::JudgedRelation& judged,
                       const std::vector<std::string>& notes) {
  const auto failed =
      std::count_if(judged.verdicts.begin(), judged.verdicts.end(), [](const Verdict& v) { return !v.holds; });
  nlohmann::json sharpest, differences = nlohmann::json::array();
  for (const double difference : judged.differences) differences.push_back(json_number(difference));
  if (judged.sharpest.frame >= 0) {
    sharpest = {{"frame", judged.sharpest.frame},
                {"bound", json_number(judged.sharpest.bound)},
                {"moved", json_number(judged.sharpest.moved)}};
  }
  return {{"format", "cutproof.relate"},
          {"format_version", 1},
          {"cutproof", kVersion},
          {"sources", options.files},
          {"noise", options.noise},
          {"map", options.map},
          {"frames", judged.frames},
          {"particles", judged.particles},
          {"sharpest", sharpest},
          {"differences", differences},
          {"verdicts", io::verdicts_json(judged.verdicts, false)},
          {"not_judged", not_judged_json(judged.not_judged)},
          {"summary", {{"holds", judged.holds()}, {"verdicts", judged.verdicts.size()}, {"failed", failed}}},
          {"notes", notes}};
}

constexpr int kGreatestPower = 100;

// "young=-1,-2,1", of a scalar, or "young=-1,-2,1,direction".
std::pair<std::string, oracles::ArrayRule> rule_given(const std::string& text) {
  const auto wrong = [&] [[noreturn]] {
    refuse("--dimension", fmt::format("'{}' names no array with its powers of length, time and mass", text),
           "write NAME=L,T,M, or NAME=L,T,M,point, …,velocity, …,direction or …,axial for vectors");
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) wrong();
  oracles::ArrayRule rule;
  rule.known = true;
  rule.how = oracles::Follows::scalar;
  int powers[3] = {};
  std::string_view kind = std::string_view(text).substr(equals + 1);
  for (int k = 0; k < 3; ++k) {
    if (k > 0 && !kind.starts_with(',')) wrong();
    const char* const begin = kind.data() + (k > 0 ? 1 : 0);
    const auto [stop, error] = std::from_chars(begin, kind.data() + kind.size(), powers[k]);
    if (error != std::errc{} || std::abs(powers[k]) > kGreatestPower) wrong();
    kind.remove_prefix(static_cast<std::size_t>(stop - kind.data()));
  }
  if (kind == ",point") {
    rule.how = oracles::Follows::point;
  } else if (kind == ",velocity") {
    rule.how = oracles::Follows::velocity;
  } else if (kind == ",direction") {
    rule.how = oracles::Follows::direction;
  } else if (kind == ",axial") {
    rule.how = oracles::Follows::axial;
  } else if (!kind.empty()) {
    wrong();
  }
  rule.of = {powers[0], powers[1], powers[2]};
  return {text.substr(0, equals), rule};
}

int make(const RelateOptions& options) {
  if (options.files.size() != 2) refuse("--make", "it takes two files", "give the input and the file to write");
  std::vector<std::pair<std::string, oracles::ArrayRule>> more;
  for (const std::string& text : options.dimensions) more.push_back(rule_given(text));
  const oracles::RunMap map = oracles::RunMap::parse(options.make);
  io::ArrayFile contents = io::read_array_file(options.files[0]);
  contents.arrays = oracles::mapped_input(map, contents.arrays, more, options.files[0]);
  io::write_array_file(options.files[1], contents);
  print_written(options.files[1]);
  return 0;
}

int relate(const RelateOptions& options) {
  if (!options.make.empty()) return make(options);
  if (options.map.empty()) refuse("--map", "nothing says how the runs correspond", "write --map same, or another map");
  const oracles::RunMap map = oracles::RunMap::parse(options.map);
  const bool is_open = map.name() == "refine" || map.name() == "split";
  const std::size_t least = map.name() == "refine" ? 3 : 2;
  if (options.files.size() < least || (!is_open && options.files.size() > 2))
    refuse("--map",
           fmt::format("'{}' is asked of {} runs, and {} are given", map.name(),
                       is_open ? fmt::format("{} or more", least) : "2", options.files.size()),
           map.name() == "refine"  ? "give the coarsest run first"
           : map.name() == "split" ? "give the run of all bodies first, then those of each alone"
                                   : "give the run and the one that corresponds");
  if (map.name() == "refine") {
    if (options.bits) refuse("--bits", "runs with other substeps have other bits", "leave it out");
    if (!options.noise.empty()) refuse("--noise", "'refine' compares with no noise", "leave it out");
  }
  if (options.bits && !map.is_exact()) refuse("--bits", fmt::format("'{}' rounds", options.map), "leave it out");
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  const StateReports reports = {options.json, options.junit, options.report, options.again};
  const harness::RelatedFiles files = {
      options.files[0], {options.files.begin() + 1, options.files.end()}, options.noise, options.bits};
  const harness::JudgedRelation judged = [&] {
    Progress progress("frame", 0);
    return harness::judge_relation(map, files, [&](int64_t frame) { progress.show(frame + 1, "judging"); });
  }();
  const std::vector<std::string> notes = notes_of(judged, !options.noise.empty());
  const nlohmann::json document = to_json(options, judged, notes);
  write_document(options.json, document);
  if (!options.report.empty()) write_relate_page(options.report, map, options.files, judged, document, options.again);
  const Judging judging{"cutproof relate", class_of("relate", map.name()), options.again, Judging::Of::frames};
  say("relate {}: {} frames of {} particles\n", options.map, judged.frames, judged.particles);
  Shown shown{options.again};
  shown.in_stages = false;
  show_judged(judged.verdicts, judged.not_judged, notes, shown, judging, reports);
  return judged.holds() ? 0 : 1;
}

}  // namespace

void add_relate(CLI::App& program, Work& work) {
  const auto options = std::make_shared<RelateOptions>();
  CLI::App* const command = program.add_subcommand("relate", "judge whether two runs correspond as their inputs do");
  command->add_option("files", options->files, "runs, the first of which the others are compared with")
      ->required()
      ->type_name("RUN");
  auto* const map = command->add_option("--map", options->map,
                                        "how they correspond: same, reset, checkpoint, units:4,1,1, mirror:x, "
                                        "rotate:90z, shift:X,Y,Z, boost:X,Y,Z, permute, split or refine");
  map->type_name("WORD");
  auto* const make = command->add_option("--make", options->make,
                                         "write the input that corresponds: of the first file, to the second");
  make->type_name("WORD")->excludes(map);
  command->add_option("--noise", options->noise, "runs of the first, disturbed by one rounding in each frame")
      ->type_name("RUN")
      ->excludes(make);
  command->add_option("--dimension", options->dimensions, "of an array of --make that cutproof does not know")
      ->type_name("NAME=L,T,M")
      ->needs(make);
  command->add_flag("--bits", options->bits, "the bits must be the same, too")->excludes(make);
  add_json(*command, options->json, "write verdicts");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return relate(*options); };
  });
}

}  // namespace cutproof::cli
