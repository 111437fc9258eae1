#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <utility>

#include "cli/baseline.h"
#include "cli/check_run.h"
#include "cli/check_state.h"
#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/recordings.h"
#include "cli/report_page.h"
#include "cli/results.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "harness/recorded_run.h"
#include "harness/scene_judge.h"
#include "model/io/array_file.h"
#include "model/io/recording.h"
#include "model/io/run_segments.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

struct CheckOptions {
  std::string recording;
  std::string depth{name_of(harness::Depth::motion)};
  std::string json, junit, report, baseline;
  std::string again;  // the command line
};

int check_recording(const CheckOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const harness::Depth depth = depth_asked(options.depth);
  const OpenRecording opened = open_recording(options.recording);
  const io::RecordingReader& reader = *opened.reader;
  const io::Recording& recording = reader.header();
  const Scene& scene = opened.scene;
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  const std::optional<Baseline> baseline =
      read_baseline(options.baseline, {"cutproof.check", "cutproof.run"}, scene.name);

  harness::Promises promises;
  promises.words =
      harness::parse_promises(recording.promises, io::recording_paths(options.recording).index, "promises");

  const auto initial = std::make_shared<const State>(reader.snapshot(0).state);
  say("recording {}: scene {}, backend {}, {} snapshots of {} particles\n", options.recording,
      scene.name.empty() ? "(none)" : printable(scene.name), printable(recording.backend), recording.snapshot_count,
      recording.setup.body.particle_count());
  harness::SceneJudge judge(recording.setup, scene.expect, recording.backend, initial, depth, promises,
                            opened.is_cut_short ? harness::Extent::cut_short : harness::Extent::whole);
  RunResult result{"check", options.recording,    recording.backend,
                   scene,   recording.setup.body, initial->clusters.count()};
  {
    Progress progress("frame", recording.setup.frame_count());
    const auto wrong = harness::walk_recording(
        reader, initial, [&](const harness::Moment& moment) { judge.see(moment); },
        [&](const harness::FrameResult& frame) {
          result.frames.push_back(frame);
          progress.show(frame.frame + 1, "judging");
        });
    for (const Verdict& verdict : wrong) judge.add(verdict);
  }
  if (depth == harness::Depth::motion) {
    judge.note("A recording cannot be run: relations between runs, such as 'no ghost force', were not judged.");
  }
  judge.finish();
  // The file first: it is kept even if standard output cannot be written.
  nlohmann::json document = to_json(result, &judge);
  const std::optional<SinceBaseline> since = since_baseline(baseline, document);
  write_document(options.json, document);
  if (!options.report.empty()) write_report(options.report, reader, document, made_by(options.again));
  const Judging judging{"cutproof check", class_of("check", scene.name.empty() ? "recording" : scene.name),
                        options.again};
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  std::vector<io::JunitCase> cases = cases_of(judge, judging);
  if (since) excuse_known(*since, cases);
  write_junit(options.junit, judging, seconds.count(), std::move(cases));
  print_verdicts(judge, options.again);
  print_written(options.json);
  print_written(options.report);
  print_conclusion(judge);
  if (since) print_since(*since);
  ForGitHub said = {options.again,
                    failures_of(judge.verdicts(), judging,
                                [&](const Verdict& verdict) {
                                  return judge.is_expected_failure(verdict) ||
                                         (since && since->is_known(verdict, true));
                                }),
                    judge.left_to_reference()};
  if (since) add_baseline_to(said, *since);
  tell_github(said);
  return judge.holds() || (since && since->excuses()) ? 0 : 1;
}

int check(const CheckOptions& options) {
  const bool has_segments = io::RunSegments::has_segments(options.recording);
  if (!has_segments && !io::is_array_file(options.recording)) return check_recording(options);
  depth_asked(options.depth);  // there is no motion to leave out, but a depth that is none is refused all the same
  const StateReports reports = {options.json, options.junit, options.report, options.again, options.baseline};
  if (has_segments) return check_run(io::RunSegments(options.recording), options.recording, reports);
  io::ArrayFile contents = io::read_array_file(options.recording);
  if (io::RunSegments::is_segment(contents)) {
    std::vector<io::ArrayFile> only(1);
    only.front() = std::move(contents);
    return check_run(io::RunSegments(options.recording, std::move(only)), options.recording, reports);
  }
  return check_state(contents, options.recording, reports);
}

}  // namespace

void add_check(CLI::App& program, Work& work) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* const command =
      program.add_subcommand("check", "judge a recording, or a state or run of another simulator");
  command
      ->add_option("recording", options->recording, "a recording (name given to --record), NPZ or HDF5 file, or folder")
      ->required()
      ->type_name("RECORDING");
  add_check_depth(*command, options->depth, "depth of judging");
  add_json(*command, options->json, "write verdicts and counts as JSON");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  add_baseline(*command, options->baseline);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return check(*options); };
  });
}

}  // namespace cutproof::cli
