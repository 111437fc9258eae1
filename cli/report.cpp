// `cutproof report`: a page for a browser, from a recording and what was judged of it.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "report/page.h"

namespace cutproof::cli {

namespace {

struct ReportOptions {
  std::string recording, output;
  std::vector<std::string> others;  // another recording, results, or both
};

bool is_recording(const std::string& name) { return std::filesystem::exists(io::recording_paths(name).index); }

std::string scene_name(const io::Recording& recording, const std::string& file) {
  return recording.scene_json.empty() ? "" : io::parse_scene(recording.scene_json, file + " (its scene)").name;
}

// Names of two recordings that a person tells apart: by backends, unless these are alike.
std::pair<std::string, std::string> told_apart(const io::Recording& one, const std::string& one_file,
                                               const io::Recording& other, const std::string& other_file) {
  if (one.backend != other.backend) return {one.backend, other.backend};
  return {one_file, other_file};
}

int make_report(const ReportOptions& options) {
  report::require_pages("report");
  require_writable(options.output);
  std::string beside_file, results_file;
  for (const std::string& name : options.others) {
    std::string& file = is_recording(name) ? beside_file : results_file;
    if (!file.empty()) {
      refuse(name, "of recordings a page shows two, and of results those of the first",
             "give RECORDING, then at most one other recording and one file of results");
    }
    file = name;
  }
  const io::RecordingReader reader(options.recording);
  const io::Recording& recording = reader.header();
  const std::string scene = scene_name(recording, options.recording);
  report::Results results;
  if (results_file.empty()) {
    results = report::unjudged(recording, scene);
  } else {
    results = report::read_results(results_file);
    report::require_same_run(recording, scene, options.recording, results, results_file);
  }
  std::optional<io::RecordingReader> other;
  std::optional<ReadBeside> beside;
  if (!beside_file.empty()) {
    other.emplace(beside_file);
    report::require_same_body(recording, options.recording, other->header(), beside_file);
    auto [own_name, name] = told_apart(recording, options.recording, other->header(), beside_file);
    beside.emplace(ReadBeside{*other, true, std::move(name), std::move(own_name),
                              "the same particle of the other recording, in the same moment"});
  }
  write_page(options.output, reader, results, "cutproof check " + quoted(options.recording),
             beside ? &*beside : nullptr);
  print_written(options.output);
  insist("{}\n", !results.checked ? "nothing on the page is judged: give results for that"
                 : results.holds  ? "everything on the page holds"
                                  : "NOT everything on the page holds");
  return 0;
}

}  // namespace

void add_report(CLI::App& program, Work& work) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* const command = program.add_subcommand("report", "make a page for a browser from a recording");
  command->add_option("recording", options->recording, "what `run --record` has written")
      ->required()
      ->type_name("RECORDING");
  command
      ->add_option("others", options->others,
                   "what `run --json` or `check --json` has written of it (without, nothing on the page is judged); "
                   "another recording of the same scene, to stand beside it")
      ->expected(0, 2)
      ->type_name("[RESULTS] [RECORDING]");
  command->add_option("-o,--output", options->output, "the page to write")->required()->type_name("F");
  command->callback([options, &work] { work = [options] { return make_report(*options); }; });
}

}  // namespace cutproof::cli
