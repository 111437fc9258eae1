#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <chrono>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "cli/against_report.h"
#include "cli/baseline.h"
#include "cli/commands.h"
#include "cli/errors_report.h"
#include "cli/findings.h"
#include "cli/interruption.h"
#include "cli/mesh_report.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/preview.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/results.h"
#include "cli/scene_files.h"
#include "cli/scene_options.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "harness/backends.h"
#include "harness/run_session.h"
#include "model/counted.h"
#include "model/io/columns.h"
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
  std::string json, junit, report, baseline;
  std::string preview;  // a page of the scene before it runs, and nothing else
  std::string again;    // the command line
};

// [iterations of a particle] Beyond that a run takes minutes.
constexpr double kLongWork = 1e9;

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

using harness::AgainstMode;
using harness::RunSession;

AgainstMode against_mode(const RunOptions& options) {
  const harness::BackendDescriptor* const other = harness::find_backend(options.against);
  if (other == nullptr || !other->is_the_reference) {
    refuse("--against", fmt::format("there is no comparison with '{}'", options.against),
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
  const auto moves = static_cast<double>(built.setup.frame_count()) * step.substeps * step.iterations *
                     static_cast<double>(built.setup.body.particle_count());
  if (moves < kLongWork) return;
  say("long work: an iteration moves each particle, {:.1g} moves in all, of which one core makes some 1e7 a second; "
      "--frames N stops early, and what was judged by then is kept at the first Ctrl-C\n",
      moves);
  flush_output();
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

// Of a stopped run; empty for every other.
std::string how_far(const RunSession& session, const fixtures::Built& built) {
  if (!session.is_stopped()) return "";
  return fmt::format("it was stopped after {} of {} frames", session.frames().size(), built.setup.frame_count());
}

constexpr const char* kConservation = "conservation";
constexpr const char* kNotConserved = "the momentum or energy of the free body changes by more than its bound";

io::JunitCase conservation_case(const harness::Errors& errors, const Judging& judging) {
  io::JunitCase one{kConservation, judging.class_name};
  if (!errors.holds()) {
    one.outcome = io::JunitOutcome::failed;
    one.message = kNotConserved;
    one.text = fmt::format("{}\nsee it again: {}\n", kNotConserved, judging.again);
  }
  return one;
}

// These are measured by runs of their own.
void require_errors(const Backend& backend, const harness::ErrorsWanted& wanted) {
  const bool frames = backend.can_run({}), steps = frames || backend.can_run({Stage::step, Stage::step});
  if ((wanted.time_step || wanted.conservation) && !frames) {
    refuse("--errors", "this backend does not run whole frames", "leave time_step and conservation out");
  }
  if (wanted.solver && !steps) refuse("--errors", "this backend does not run the step", "leave solver out");
}

harness::Observers observers_wanted(const RunOptions& options) {
  harness::Observers observers;
  if (!options.check.empty()) observers.judge = depth_asked(options.check);
  if (!options.against.empty()) observers.against = against_mode(options);
  if (!options.errors.empty()) {
    observers.errors = errors_wanted(options.errors);
    observers.errors->frames = options.error_frames;
    if (observers.errors->implementation) {
      const bool is_alone = observers.against.value_or(AgainstMode::lockstep) == AgainstMode::lockstep;
      observers.against = is_alone ? AgainstMode::lockstep : AgainstMode::both;
    }
  }
  observers.record = options.record;
  observers.page = options.report;
  return observers;
}

fixtures::BuildOptions build_options_of(const RunOptions& options) {
  fixtures::BuildOptions build_options;
  build_options.frames = options.frames;
  if (!options.mesh.empty()) {
    build_options.mesh = MeshSpec{options.mesh, metres_per(options.unit), options.repair, options.repair_change};
  }
  build_options.on_repair_step = repair_progress();
  return build_options;
}

// As kept in a recording, for which the mesh is not read again.
std::string recorded_scene(Scene scene, const std::optional<MeshSpec>& mesh) {
  if (mesh) {
    scene.body.shape.reset();
    scene.body.mesh = mesh;
    scene.body.mesh->file = printable(mesh->file);
  }
  return io::write_scene(scene);
}

nlohmann::json document_of(const RunSession& session, const RunResult& result, const fixtures::Built& built,
                           const std::vector<io::SceneChange>& changes) {
  nlohmann::json document = to_json(result, session.judge());
  document["build"] = build_json(built);
  document["changes"] = given_changes(changes);
  document["complete"] = !session.is_stopped();
  if (session.judge() == nullptr) {
    document["left_to_reference"] = {{"stages", session.left_to_reference()}, {"expected", nlohmann::json::array()}};
  }
  const harness::Against* const against = session.against();
  if (against != nullptr) {
    document["against"] = to_json(*against, built.setup);
    document["against"]["verdicts"] = io::verdicts_json(against->verdicts());
  }
  if (const harness::Errors* const errors = session.errors(); errors != nullptr) {
    document["errors"] = to_json(*errors, errors->wanted().implementation ? &*against->lockstep : nullptr);
  }
  return document;
}

void write_run_page(const RunOptions& options, const RunSession& session, const nlohmann::json& document) {
  if (session.recording() == nullptr) return;
  std::optional<ReadBeside> beside;
  if (session.reference_recording() != nullptr) {
    beside.emplace(ReadBeside{
        *session.reference_recording(), false, std::string(harness::reference_backend().name), options.backend.name,
        session.against()->lockstep ? "the same particle of the reference, which ran each stage from this "
                                      "run's own state before it (lockstep)"
                                    : "the same particle of the reference, which began alike and ran by "
                                      "itself, up to the first decision in which the two differ"});
  }
  write_report(options.report, *session.recording(), document, made_by(options.again, options.backend.name),
               beside ? &*beside : nullptr);
}

std::vector<io::JunitCase> cases_of_run(const RunSession& session, const Judging& judging, const std::string& how_far,
                                        const SinceBaseline* since) {
  std::vector<io::JunitCase> cases =
      session.judge() != nullptr ? cases_of(*session.judge(), judging) : cases_of(session.broken_contracts(), judging);
  const auto add = [&](std::vector<io::JunitCase> more) {
    cases.insert(cases.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
  };
  if (session.judge() == nullptr) add(cases_of_left(session.left_to_reference(), judging));
  if (session.against() != nullptr) add(cases_of(session.against()->verdicts(), judging));
  if (session.errors() != nullptr && session.errors()->conservation()) {
    add({conservation_case(*session.errors(), judging)});
  }
  if (!how_far.empty()) {
    add({{kEnoughJudged, judging.class_name, 0, io::JunitOutcome::error, how_far, "see it again: " + judging.again}});
  }
  if (since != nullptr) excuse_known(*since, cases);
  return cases;
}

void conclude_run(const RunSession& session, const std::string& again) {
  if (session.judge() != nullptr) {
    print_conclusion(*session.judge());
    return;
  }
  const Shown of_the_run{again};
  print_verdicts(session.broken_contracts(), of_the_run);
  if (session.against() == nullptr) {
    insist("nothing was judged: add --check for that\n");
    return;
  }
  const std::vector<std::string> left = session.left_to_reference();
  if (!left.empty()) say("{}\n", unsettled(left_in_words(left)));
  std::vector<Verdict> all = session.against()->verdicts();
  all.insert(all.end(), session.broken_contracts().begin(), session.broken_contracts().end());
  print_conclusion(all, of_the_run, "what was compared holds.");
}

void tell_github_of_run(const RunSession& session, const Judging& judging, const std::string& how_far,
                        const SinceBaseline* since) {
  const harness::SceneJudge* const judge = session.judge();
  const auto is_excused = [&](const Verdict& verdict) {
    return (judge != nullptr && judge->is_expected_failure(verdict)) ||
           (since != nullptr && since->is_known(verdict, true));
  };
  ForGitHub said = {judging.again,
                    failures_of(judge != nullptr ? judge->verdicts() : session.broken_contracts(), judging, is_excused),
                    judge != nullptr ? judge->left_to_reference() : session.left_to_reference()};
  if (session.against() != nullptr) {
    for (Failure& failure : failures_of(session.against()->verdicts(), judging, is_excused))
      said.failures.push_back(std::move(failure));
  }
  if (session.errors() != nullptr && !session.errors()->holds() &&
      (since == nullptr || !since->is_known(kConservation))) {
    said.failures.push_back({kConservation, kNotConserved, judging.again});
  }
  if (!how_far.empty()) said.failures.push_back({kEnoughJudged, how_far, judging.again});
  if (since != nullptr) add_baseline_to(said, *since);
  tell_github(said);
}

// Nothing runs, so there is nothing to judge, to compare or to write.
void require_alone(const RunOptions& options) {
  for (const auto& [name, value] : {std::pair{"--check", &options.check},
                                    {"--against", &options.against},
                                    {"--errors", &options.errors},
                                    {"--record", &options.record},
                                    {"--json", &options.json},
                                    {"--junit", &options.junit},
                                    {"--baseline", &options.baseline},
                                    {"--report", &options.report}}) {
    if (!value->empty())
      refuse("--preview", fmt::format("nothing runs, so {} has nothing to work on", name),
             fmt::format("leave out --preview or {}", name));
  }
}

int preview(const RunOptions& options) {
  require_alone(options);
  require_report(options.preview, "--preview");
  const std::vector<io::SceneChange> changes = changes_of(options.scene);
  const Scene scene = io::read_scene(options.scene.file, changes);
  const fixtures::Built built = with_sources(options.scene.file, changes, [&] {
    return fixtures::build(scene, options.scene.file, build_options_of(options));
  });
  print_header(scene, built, options);
  write_preview(options.preview, scene, built, options.again);
  print_written(options.preview);
  return 0;
}

int run(const RunOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const harness::Observers observers = observers_wanted(options);
  const fixtures::BuildOptions build_options = build_options_of(options);
  const std::unique_ptr<Backend> backend = make_backend(options.backend);
  if (observers.errors) require_errors(*backend, *observers.errors);

  const std::vector<io::SceneChange> changes = changes_of(options.scene);
  Scene scene = io::read_scene(options.scene.file, changes);
  std::vector<std::string> notes;
  if (const auto not_asked = take_replaced_counts(options.scene, scene.expect); !not_asked.empty()) {
    notes.push_back(fmt::format("The expected number of {} was not judged: {} changes it.",
                                fmt::join(not_asked, " and "), options.scene.particles ? "--particles" : "--spacing"));
  }
  const fixtures::Built built = with_sources(options.scene.file, changes,
                                             [&] { return fixtures::build(scene, options.scene.file, build_options); });
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  if (!options.junit.empty() && !observers.judge && !observers.against) {
    refuse("--junit", "nothing is judged, so there are no test cases", "add --check or --against");
  }
  if (!options.baseline.empty() && !observers.judge && !observers.against) {
    refuse("--baseline", "there are no verdicts to compare with it", "add --check or --against");
  }
  const std::optional<Baseline> baseline =
      read_baseline(options.baseline, {"cutproof.run", "cutproof.check"}, scene.name);
  RunSession session(
      {built.setup, built.state, scene.expect, options.backend.name, recorded_scene(scene, build_options.mesh),
       built.schedule.is_cut_short ? options.frames : std::nullopt, notes},
      observers, *backend, [&] { return make_backend(options.backend); });
  const EndsInOrder in_order;
  print_header(scene, built, options);
  {
    Progress progress("frame", built.setup.frame_count());
    progress.tell("the first one is running");
    session.run(
        [&](const harness::FrameResult& frame) {
          progress.show(frame.frame + 1, fmt::format("{} clusters, {} particles", frame.clusters, frame.alive));
        },
        stop_asked);
  }

  const RunResult result{"run",           options.scene.file, options.backend.name,
                         scene,           built.setup.body,   built.state.clusters.count(),
                         session.frames()};
  nlohmann::json document = document_of(session, result, built, changes);
  const std::optional<SinceBaseline> compared = since_baseline(baseline, document);
  const SinceBaseline* const since = compared ? &*compared : nullptr;
  const std::string stopped = how_far(session, built);
  // Files first: they are kept even if standard output cannot be written.
  write_document(options.json, document);
  write_run_page(options, session, document);
  const Judging judging{"cutproof run", class_of("run", scene.name), options.again};
  if (!options.junit.empty()) {
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    write_junit(options.junit, judging, seconds.count(), cases_of_run(session, judging, stopped, since));
  }

  print_summary(result);
  if (session.judge() != nullptr) print_verdicts(*session.judge(), options.again);
  if (session.against() != nullptr) print_against(*session.against(), options.again);
  if (session.errors() != nullptr) print_errors(*session.errors(), document["errors"]);
  if (!options.record.empty()) {
    const io::RecordingPaths paths = io::recording_paths(options.record);
    say_copy("recorded", paths.index);
    say("for ParaView:\n");
    for (const std::string& file : {paths.particles, paths.skin, paths.blade}) say_copy(" ", file);
  }
  print_written(options.json);
  print_written(options.junit);
  print_written(options.report);
  conclude_run(session, options.again);
  if (since != nullptr) print_since(*since);
  if (!stopped.empty()) insist("{}: {}\n", unsettled("INCOMPLETE"), stopped);
  tell_github_of_run(session, judging, stopped, since);
  return session.holds() || (since != nullptr && since->excuses() && stopped.empty()) ? 0 : 1;
}

}  // namespace

void add_run(CLI::App& program, Work& work) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* const command = program.add_subcommand("run", "simulate a scene; with --check, judge every frame");
  add_scene(*command, options->scene);
  add_backend(*command, options->backend, "backend under test");
  add_check_depth(*command, options->check, "judge every frame by every property and by the scene's expectations")
      ->expected(0, 1);
  add_report_option(*command, options->report);
  command->add_option("--mesh", options->mesh, "closed surface mesh that replaces the scene's body")->type_name("FILE");
  add_unit(*command, options->unit)->needs("--mesh");
  command->add_flag("--repair", options->repair, "repair the mesh if it bounds no solid, and report the changes")
      ->needs("--mesh");
  command
      ->add_option("--repair-change", options->repair_change,
                   "greatest change of volume by --repair, as a share; 1: any change")
      ->capture_default_str()
      ->type_name("X")
      ->check(number_between(0, 1))
      ->needs("--repair");
  add_count(*command, "--frames", options->frames,
            "stop after this many frames; expectations beyond them are not judged", whole_number(0));
  command
      ->add_option("--against", options->against,
                   fmt::format("compare every stage with this backend: {}", harness::reference_backend().name))
      ->type_name("B")
      ->check(usually_one_of({std::string(harness::reference_backend().name)}));
  command->add_option("--mode", options->mode, "mode of the comparison: lockstep, free-running or both")
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
            "frames for solver error and interpenetration, evenly over the run", whole_number(1))
      ->needs("--errors");
  command->add_option("--record", options->record, "record every frame, for `cutproof check` and ParaView")
      ->type_name("F");
  add_json(*command, options->json, "write verdicts, stage times and counts as JSON");
  add_junit(*command, options->junit);
  command
      ->add_option("--preview", options->preview,
                   "only write a page for a browser that shows the body and the blade's path")
      ->type_name("F");
  add_baseline(*command, options->baseline);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    // --check before the scene has no depth.
    if (options->scene.file.empty() && !options->check.empty() && !harness::depth_named(options->check)) {
      options->scene.file = std::exchange(options->check, std::string(name_of(harness::Depth::motion)));
    }
    work = [options] {
      if (!options->scene.file.empty()) {
        options->scene.file = scene_file(options->scene.file);
        return options->preview.empty() ? run(*options) : preview(*options);
      }
      print_error({kNextSteps});
      return 2;
    };
  });
}

}  // namespace cutproof::cli
