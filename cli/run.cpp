#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>

#include "cli/against_report.h"
#include "cli/commands.h"
#include "cli/errors_report.h"
#include "cli/findings.h"
#include "cli/mesh_report.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/results.h"
#include "cli/scene_files.h"
#include "cli/scene_options.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "harness/against.h"
#include "harness/backends.h"
#include "harness/frame_runner.h"
#include "harness/relation_sample.h"
#include "harness/scene_judge.h"
#include "model/counted.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "model/io/verdict_json.h"
#include "model/left_stages.h"
#include "model/printable.h"

namespace cutproof::cli {

using harness::make_backend;

namespace {

struct RunOptions {
  SceneOptions scene;
  harness::BackendChoice backend;
  std::optional<int64_t> frames;
  std::string mesh;         // takes the place of the scene's body
  std::string unit = "mm";  // of the mesh's numbers
  bool repair = false;      // the mesh
  double repair_change = kMostRepairChange;
  std::string check;          // a depth; empty: nothing is judged
  std::string against;        // "" or the reference
  std::string mode = "both";  // of the comparison: lockstep, free-running, both
  std::string errors;         // names of errors with commas between them, or "all"; empty: none
  int64_t error_frames = harness::ErrorsWanted{}.frames;
  std::string record;
  std::string json, junit, report;
  std::string again;  // the command line
};

constexpr const char* kNextSteps =
    "cutproof run needs a scene. Try\n"
    "  cutproof run kidney_discontinuous --check\n"
    "      cuts a kidney in two steps and certifies every frame\n"
    "  cutproof run kidney_discontinuous --check --mesh KIDNEY.stl --unit mm\n"
    "      does the same on your own closed surface mesh (STL, OBJ, PLY, OFF)\n"
    "  cutproof run three_cuts --check --record cuts --json cuts.json\n"
    "      keeps a recording for ParaView and `cutproof check`, and the verdicts for a machine\n"
    "  cutproof info --scenes\n"
    "      lists the scenes that come with the program\n"
    "  cutproof info --scene\n"
    "      lists every field of a scene file\n";

using harness::Against;
using harness::AgainstMode;

AgainstMode against_mode(const RunOptions& options) {
  const harness::BackendDescriptor* const other = harness::find_backend(options.against);
  if (other == nullptr || !other->is_the_reference) {
    refuse("--against", fmt::format("'{}' is nothing to compare with", options.against),
           fmt::format("use --against {}", harness::reference_backend().name));
  }
  return options.mode == "lockstep"       ? AgainstMode::lockstep
         : options.mode == "free-running" ? AgainstMode::free_running
                                          : AgainstMode::both;
}

void print_header(const Scene& scene, const fixtures::Built& built, const RunOptions& options) {
  const Body& body = built.setup.body;
  const fixtures::Bounds box = fixtures::path_box(body);
  const Vec3 size = 1e3 * (box.high - box.low);
  say("scene {}: {}\n", printable(scene.name), printable(scene.description));
  say("body {}, {:.4g} × {:.4g} × {:.4g} mm, {} at h = {:.4g} mm, {}\n", body.name, size.x, size.y, size.z,
      counted(body.particle_count(), "particle", "particles"), body.grid.spacing * 1e3,
      counted(built.state.clusters.count(), "cluster", "clusters"));
  if (!options.mesh.empty()) say("one unit of the mesh is 1 {} (--unit changes that)\n", options.unit);
  print_build(built);
  const StepParameters& step = built.setup.step;
  say("{} of {} × {}, backend {}, seed {}\n", counted(built.setup.frame_count(), "frame", "frames"),
      counted(step.substeps, "substep", "substeps"), counted(step.iterations, "iteration", "iterations"),
      options.backend.name, scene.seed);
}

void print_summary(const RunResult& result) {
  double total = 0;
  std::array<double, 6> seconds = {};
  std::array<int64_t, 6> launched = {};
  int64_t removed = 0, debris = 0;
  for (const harness::FrameResult& frame : result.frames) {
    total += frame.total_seconds;
    for (std::size_t s = 0; s < 6; ++s) {
      seconds[s] += frame.seconds[s];
      launched[s] += frame.ran[s];
    }
    removed += frame.removed;
    debris += frame.debris;
  }
  say("\n{:<8} {:>7} {:>14}\n", "stage", "frames", "ms per frame");
  for (const Stage stage : kStages) {
    const auto s = static_cast<std::size_t>(stage);
    say("{:<8} {:>7} {:>14}\n", name_of(stage), launched[s],
        launched[s] == 0 || seconds[s] == 0
            ? "-"
            : fmt::format("{:.3f}", 1e3 * seconds[s] / static_cast<double>(launched[s])));
  }
  if (!result.frames.empty()) {
    say("{:<8} {:>7} {:>14.3f}\n", "all", result.frames.size(),
        1e3 * total / static_cast<double>(result.frames.size()));
  }
  const int64_t clusters = result.frames.empty() ? result.clusters_at_start : result.frames.back().clusters;
  say("removed {} ({} as debris); clusters {} -> {}\n", counted(removed + debris, "particle", "particles"), debris,
      result.clusters_at_start, clusters);
}

constexpr const char* kConservation = "conservation";
constexpr const char* kNotConserved = "the body alone keeps its momentum or its energy less well than its bound says";

io::JunitCase conservation_case(const harness::Errors& errors, const Judging& judging) {
  io::JunitCase one{kConservation, judging.class_name};
  if (!errors.holds()) {
    one.outcome = io::JunitOutcome::failed;
    one.message = kNotConserved;
    one.text = fmt::format("{}\nsee it again: {}\n", kNotConserved, judging.again);
  }
  return one;
}

// The comparison goes stage by stage.
void compare(Against& against, const Setup& setup, const harness::Moment& moment, const std::array<bool, 6>& ran) {
  const auto due = harness::due_stages(setup, *moment.before, moment.span, *moment.after);
  if (std::count(due.begin(), due.end(), true) > 1) {
    refuse("--against", "this backend runs several stages in one piece",
           "choose one that runs them one by one, or leave --against out");
  }
  against.see(moment.span.last, *moment.after, ran[static_cast<std::size_t>(moment.span.last)], moment.by_backend);
}

// These are measured by runs of their own.
void require_errors(const Backend& backend, const harness::ErrorsWanted& wanted) {
  const bool frames = backend.can_run({}), steps = frames || backend.can_run({Stage::step, Stage::step});
  if ((wanted.time_step || wanted.conservation) && !frames) {
    refuse("--errors", "this backend does not run whole frames", "leave time_step and conservation out");
  }
  if (wanted.solver && !steps) refuse("--errors", "this backend does not run the step", "leave solver out");
}

int run(const RunOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  std::optional<harness::Depth> depth;
  if (!options.check.empty()) depth = depth_asked(options.check);
  std::optional<AgainstMode> mode;
  if (!options.against.empty()) mode = against_mode(options);
  harness::ErrorsWanted wanted = errors_wanted(options.errors);
  wanted.frames = options.error_frames;
  if (wanted.implementation)
    mode = mode.value_or(AgainstMode::lockstep) == AgainstMode::lockstep ? AgainstMode::lockstep : AgainstMode::both;
  fixtures::BuildOptions build_options;
  build_options.frames = options.frames;
  if (!options.mesh.empty()) {
    build_options.mesh = MeshSpec{options.mesh, metres_per(options.unit), options.repair, options.repair_change};
  }
  build_options.on_repair_step = repair_progress();
  const std::unique_ptr<Backend> backend = make_backend(options.backend);
  require_errors(*backend, wanted);

  const std::vector<io::SceneChange> changes = changes_of(options.scene);
  Scene scene = io::read_scene(options.scene.file, changes);
  const std::vector<std::string> not_asked = take_replaced_counts(options.scene, scene.expect);
  fixtures::Built built = with_sources(options.scene.file, changes,
                                       [&] { return fixtures::build(scene, options.scene.file, build_options); });
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  if (!options.junit.empty() && !depth && !mode) {
    refuse("--junit", "nothing is judged, so there are no test cases", "add --check or --against");
  }
  std::optional<io::Recorder> recorder;
  // A page is made from a recording, whether somebody wants to keep that or not.
  const std::string record =
      options.record.empty() && !options.report.empty() ? passing_recording(options.report) : options.record;
  if (!record.empty()) {
    Scene recorded = scene;
    if (build_options.mesh) {
      recorded.body.shape.reset();
      recorded.body.mesh = build_options.mesh;
      recorded.body.mesh->file = printable(recorded.body.mesh->file);  // for the record: nobody reads it again
    }
    const bool is_cut_short = built.schedule.is_cut_short;
    recorder.emplace(record, built.setup, io::write_scene(recorded), options.backend.name,
                     harness::left_to_reference(*backend), is_cut_short ? options.frames : std::nullopt);
  }
  std::optional<harness::SceneJudge> judge;
  std::optional<harness::RelationSample> relations;
  std::optional<Against> against;
  std::optional<harness::Errors> errors;
  print_header(scene, built, options);

  RunResult result{"run", options.scene.file, options.backend.name,
                   scene, built.setup.body,   built.state.clusters.count()};
  harness::FrameRunner runner(*backend, {built.setup}, {built.state});
  const auto state = [&]() -> const State& { return *runner.states().front(); };
  if (depth) {
    harness::Promises promises;
    promises.words = harness::parse_promises(backend->promises(), options.backend.name, "promises");
    judge.emplace(built.setup, scene.expect, options.backend.name, runner.states().front(), *depth, promises,
                  built.schedule.is_cut_short ? harness::Extent::cut_short : harness::Extent::whole);
  }
  if (depth == harness::Depth::motion) relations.emplace(built.setup, make_backend(options.backend));
  if (mode) against.emplace(built.setup, built.state, state(), options.backend.name, *mode);
  if (!options.errors.empty()) {
    errors.emplace(wanted, built.setup, state(), [&] { return make_backend(options.backend); });
  }
  if (recorder) recorder->add(Stage::skin, state());
  // What the reference makes of the same, so that the page can show how far that is.
  std::optional<io::Recorder> reference_recorder;
  std::string reference_record;
  if (against && !options.report.empty()) {
    reference_record = passing_recording(options.report);
    reference_recorder.emplace(reference_record, built.setup, "", std::string(harness::reference_backend().name));
    // The reference computes in double precision, whatever it was handed.
    const auto add = [&](Stage stage, State after) {
      after.precision = Precision::binary64;
      reference_recorder->add(stage, after);
    };
    add(Stage::skin, built.state);
    against->observe_reference(add);
  }
  harness::StagesRun stages;
  // What was handed over to the backend may have been rounded: the state after a stage is kept as the next one begins.
  std::optional<std::pair<Stage, harness::Snapshot>> not_recorded;
  const harness::Observer see = [&](const harness::Moment& moment) {
    stages.see(built.setup, moment);
    if (judge) judge->see(moment);
    if (relations) {
      relations->see(moment);
      for (Verdict& verdict : relations->take_verdicts()) judge->add(std::move(verdict));
    }
    if (recorder && not_recorded) recorder->add(not_recorded->first, *moment.before);
    not_recorded.emplace(moment.span.last, moment.after);
    if (against) compare(*against, built.setup, moment, runner.ran());
  };
  {
    Progress progress("frame", built.setup.frame_count());
    while (!runner.is_over()) {
      const int64_t frame = state().frame;
      const bool looked_at = errors && errors->wants(frame);
      if (looked_at) errors->frame_begins(state());
      result.frames.push_back(runner.run_frame(judge || recorder || against ? see : nullptr));
      if (looked_at) errors->frame_ends(state());
      progress.show(frame + 1, fmt::format("{} clusters, {} particles", result.frames.back().clusters,
                                           result.frames.back().alive));
    }
  }
  const std::vector<Verdict> broken = runner.take_broken_contracts();
  if (judge) {
    for (const Verdict& verdict : broken) judge->add(verdict);
    if (relations) {
      for (std::string& sentence : relations->notes()) judge->note(std::move(sentence));
    }
    if (!not_asked.empty()) {
      judge->note(
          fmt::format("Of how many {} there are, what the scene expects was not asked: {} makes another number.",
                      fmt::join(not_asked, " and "), options.scene.particles ? "--particles" : "--spacing"));
    }
    judge->finish();
  }
  nlohmann::json errors_document;
  if (errors) {
    errors->finish(state());
    errors_document = to_json(*errors, wanted.implementation && against ? &*against->lockstep : nullptr);
  }
  if (recorder && not_recorded) recorder->add(not_recorded->first, *not_recorded->second);
  if (recorder) recorder->finish();
  // At once: whatever ends the run from here on leaves nothing that nobody asked for.
  std::unique_ptr<io::RecordingReader> recording;
  if (!options.report.empty()) {
    recording = options.record.empty() ? read_passing(record) : std::make_unique<io::RecordingReader>(record);
  }
  std::unique_ptr<io::RecordingReader> reference_recording;
  std::optional<ReadBeside> page_beside;
  if (reference_recorder) {
    reference_recorder->finish();
    reference_recording = read_passing(reference_record);
    page_beside.emplace(
        ReadBeside{*reference_recording, false, std::string(harness::reference_backend().name), options.backend.name,
                   against->lockstep ? "the same particle of the reference, which ran each stage from this "
                                       "run's own state before it (lockstep)"
                                     : "the same particle of the reference, which began alike and ran by "
                                       "itself, up to the first decision in which the two differ"});
  }
  // Files first: they are kept even if standard output cannot be written.
  if (!options.json.empty() || recording) {
    nlohmann::json document = to_json(result, judge ? &*judge : nullptr);
    document["build"] = build_json(built);
    document["changes"] = given_changes(changes);
    if (!judge) document["left_to_reference"] = {{"stages", stages.left()}, {"expected", nlohmann::json::array()}};
    if (against) {
      document["against"] = to_json(*against, built.setup);
      document["against"]["verdicts"] = io::verdicts_json(against->verdicts());
    }
    if (errors) document["errors"] = errors_document;
    write_document(options.json, document);
    if (recording)
      write_report(options.report, *recording, document, options.again, page_beside ? &*page_beside : nullptr);
  }

  const Judging judging{"cutproof run", "cutproof.run." + scene.name, options.again};
  const std::vector<Verdict> beside = against ? against->verdicts() : std::vector<Verdict>();
  if (!options.junit.empty()) {
    std::vector<io::JunitCase> cases = judge ? cases_of(*judge, judging) : cases_of(broken, judging);
    if (!judge) {
      for (io::JunitCase& one : cases_of_left(stages.left(), judging)) cases.push_back(std::move(one));
    }
    for (io::JunitCase& one : cases_of(beside, judging)) cases.push_back(std::move(one));
    if (errors && errors->conservation()) cases.push_back(conservation_case(*errors, judging));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    write_junit(options.junit, judging, seconds.count(), std::move(cases));
  }

  print_summary(result);
  if (judge) print_verdicts(*judge, options.again);
  if (against) print_against(*against, options.again);
  if (errors) print_errors(*errors, errors_document);
  if (!options.record.empty()) {
    const io::RecordingPaths paths = io::recording_paths(options.record);
    say_copy("recorded", paths.index);
    say("for ParaView:\n");
    for (const std::string& file : {paths.particles, paths.skin, paths.blade}) say_copy(" ", file);
  }
  print_written(options.json);
  print_written(options.junit);
  print_written(options.report);
  if (judge) {
    print_conclusion(*judge);
  } else {
    const Shown of_the_run{options.again};
    print_verdicts(broken, of_the_run);
    if (against && !stages.left().empty()) say("{}\n", undecided(left_in_words(stages.left())));
    if (against) {
      std::vector<Verdict> all = beside;
      all.insert(all.end(), broken.begin(), broken.end());
      print_conclusion(all, of_the_run, "what was compared holds.");
    } else {
      insist("nothing was judged: add --check for that\n");
    }
  }
  std::vector<Failure> failures =
      judge ? failures_of(judge->verdicts(), judging,
                          [&](const Verdict& verdict) { return judge->is_expected_failure(verdict); })
            : failures_of(broken, judging);
  for (Failure& failure : failures_of(beside, judging)) failures.push_back(std::move(failure));
  if (errors && !errors->holds()) failures.push_back({kConservation, kNotConserved, judging.again});
  print_annotations(failures, judge ? judge->left_to_reference() : stages.left());
  return broken.empty() && (!judge || judge->holds()) && (!against || against->holds()) && (!errors || errors->holds())
             ? 0
             : 1;
}

}  // namespace

void add_run(CLI::App& program, Work& work) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* const command = program.add_subcommand("run", "simulate a scene, and judge it with --check");
  add_scene(*command, options->scene);
  add_backend(*command, options->backend, "backend under test");
  command->add_option("--mesh", options->mesh, "closed surface mesh that takes the place of the scene's body")
      ->type_name("FILE");
  add_unit(*command, options->unit)->needs("--mesh");
  command->add_flag("--repair", options->repair, "repair the mesh if it does not bound a solid, and say what was done")
      ->needs("--mesh");
  command
      ->add_option("--repair-change", options->repair_change,
                   "most that --repair may change the volume by, as a share of it; 1: by anything")
      ->capture_default_str()
      ->type_name("X")
      ->check(number_between(0, 1))
      ->needs("--repair");
  add_count(*command, "--frames", options->frames,
            "stop after this many frames of the scene, and judge what is in reach", whole_number(0));
  add_check_depth(*command, options->check, "judge every frame by every property, and by what the scene expects")
      ->expected(0, 1);
  command
      ->add_option("--against", options->against,
                   fmt::format("compare every stage with this backend: {}", harness::reference_backend().name))
      ->type_name("B")
      ->check(usually_one_of({std::string(harness::reference_backend().name)}));
  command->add_option("--mode", options->mode, "of the comparison: lockstep, free-running or both")
      ->capture_default_str()
      ->type_name("M")
      ->check(one_of({"lockstep", "free-running", "both"}))
      ->needs("--against");
  command
      ->add_option("--errors", options->errors,
                   "measure errors: all, or some of implementation (as --against reference), solver, time_step, "
                   "geometry, topology, conservation")
      ->type_name("E,E...")
      ->check(usually_one_of(error_names()));
  add_count(*command, "--error-frames", options->error_frames,
            "look at solver error and interpenetration in so many frames, evenly over the run", whole_number(1))
      ->needs("--errors");
  command->add_option("--record", options->record, "keep every frame, for `cutproof check` and ParaView")
      ->type_name("F");
  add_json(*command, options->json, "write verdicts, stage times and counts");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    // Whoever writes --check before the scene means no depth by it.
    if (options->scene.file.empty() && !options->check.empty() && !harness::depth_named(options->check)) {
      options->scene.file = std::exchange(options->check, std::string(name_of(harness::Depth::motion)));
    }
    work = [options] {
      if (!options->scene.file.empty()) {
        options->scene.file = scene_file(options->scene.file);
        return run(*options);
      }
      print_error({kNextSteps});
      return 2;
    };
  });
}

}  // namespace cutproof::cli
