// `cutproof report`: a page for a browser, from a recording and what was judged of it.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "model/io/atomic_file.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "report/page.h"

namespace cutproof::cli {

namespace {

struct ReportOptions {
  std::string recording, results, output;
};

int make_report(const ReportOptions& options) {
  report::require_pages("report");
  require_writable(options.output);
  const io::RecordingReader reader(options.recording);
  const io::Recording& recording = reader.header();
  std::string scene;
  if (!recording.scene_json.empty())
    scene = io::parse_scene(recording.scene_json, options.recording + " (its scene)").name;
  report::Results results;
  if (options.results.empty()) {
    results = report::unjudged(recording, scene);
  } else {
    results = report::read_results(options.results);
    report::require_same_run(recording, scene, options.recording, results, options.results);
  }
  const report::Source source = {recording.setup, recording.snapshot_count,
                                 [&](int64_t index) { return reader.snapshot(index); }};
  io::write_text(options.output,
                 report::page(source, results, "cutproof check " + quoted(options.recording), kVersion));
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
      ->add_option("results", options->results,
                   "what `run --json` or `check --json` has written of it; without, nothing on the page is judged")
      ->type_name("RESULTS");
  command->add_option("-o,--output", options->output, "the page to write")->required()->type_name("F");
  command->callback([options, &work] { work = [options] { return make_report(*options); }; });
}

}  // namespace cutproof::cli
