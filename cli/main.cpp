#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <new>

#include "benchmarks/suites.h"
#include "cli/commands.h"
#include "model/error.h"
#include "model/io/atomic_file.h"

namespace {

constexpr const char* kNextSteps =
    "cutproof run needs a scene. Try\n"
    "  cutproof run fixtures/scenes/kidney_discontinuous.json --check\n"
    "      cuts a kidney in two steps and certifies every frame\n"
    "  cutproof run fixtures/scenes/kidney_discontinuous.json --check --mesh KIDNEY.stl --unit mm\n"
    "      does the same on your own closed surface mesh (STL, OBJ, PLY, OFF)\n"
    "  cutproof run fixtures/scenes/three_cuts.json --check --record cuts --json cuts.json\n"
    "      keeps a recording for ParaView and `cutproof check`, and the verdicts for a machine\n"
    "  cutproof info --scene\n"
    "      lists every field of a scene file\n";

// Not fmt::print, which may need memory that is not there.
int say(const char* what, int status) {
  std::fflush(stdout);
  std::fputs("cutproof: ", stderr);
  std::fputs(what, stderr);
  std::fputs("\n", stderr);
  return status;
}

// Exit status 2: bad input, 3: the machine failed. Requires an exception in flight.
int status_of_exception() noexcept {
  try {
    throw;
  } catch (const cutproof::InputError& error) {
    return say(error.what(), 2);
  } catch (const std::bad_alloc&) {
    return say("the machine has not enough memory for this", 3);
  } catch (const std::exception& error) {
    return say(error.what(), 3);
  } catch (...) {
    return say("something that is no exception was thrown: a defect of this program", 3);
  }
}

// Destructors of libraries that need memory cannot say that there is none, so they end here: nlohmann::json takes its
// values apart on a stack that it allocates.
[[noreturn]] void end_with_status() {
  const int status = std::current_exception() != nullptr ? status_of_exception() : say("a defect of this program", 3);
  std::fflush(stdout);
  cutproof::io::AtomicFile::remove_unfinished();
  std::_Exit(status);
}

// --backend, and what may be said about kernels and schedules.
void add_backend(CLI::App& command, cutproof::cli::BackendChoice& choice, const std::string& who) {
  command.add_option("--backend", choice.name, who)->capture_default_str()->type_name("B");
  command.add_option("--split", choice.split, "kernels: how clusters are split, blocks or global")->type_name("M");
  command.add_option("--rotation", choice.rotation, "kernels: how rotations are found")->type_name("M");
  command.add_option("--schedule", choice.schedule, "simulated: forward, reverse, round_robin, random or pct")
      ->capture_default_str()
      ->type_name("S");
  command.add_option("--schedule-seed", choice.seed, "simulated: what random and pct are drawn from")
      ->capture_default_str()
      ->type_name("N");
}

int run_command_line(int argc, char** argv) {
  using namespace cutproof::cli;
  CLI::App app{
      "cutproof: judges soft-body dissection. Cuts a body made of shape matching clusters and certifies every frame.\n"
      "Exit status: 0 everything holds, 1 a verdict failed, 2 bad input or usage, 3 the machine failed."};
  app.set_version_flag("--version", std::string("cutproof ") + kVersion);
  app.require_subcommand(1);

  RunOptions run_options;
  CLI::App* run_command = app.add_subcommand("run", "simulate a scene, and judge it with --check");
  run_command->add_option("scene", run_options.scene, "scene file (JSON); see `cutproof info --scene`")
      ->type_name("SCENE");
  add_backend(*run_command, run_options.backend, "who simulates; `cutproof info` lists them");
  run_command->add_option("--mesh", run_options.mesh, "closed surface mesh that takes the place of the scene's body")
      ->type_name("FILE");
  run_command->add_option("--unit", run_options.unit, "what one unit of the mesh is: mm, cm or m")
      ->capture_default_str()
      ->type_name("U")
      ->needs("--mesh");
  run_command->add_option("--particles", run_options.particles, "how many particles the body is to have")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  run_command->add_option("--frames", run_options.frames, "stop after so many frames of the scene")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  run_command->add_flag("--check", run_options.check,
                        "judge every frame with every oracle, and the scene's expectations");
  run_command->add_option("--against", run_options.against, "compare every stage with this backend: reference")
      ->type_name("B");
  run_command->add_option("--mode", run_options.mode, "of the comparison: lockstep, free-running or both")
      ->capture_default_str()
      ->type_name("M")
      ->check(CLI::IsMember({"lockstep", "free-running", "both"}))
      ->needs("--against");
  run_command
      ->add_option("--errors", run_options.errors,
                   "measure errors: all, or some of implementation (as --against reference), solver, time_step, "
                   "geometry, topology, conservation")
      ->type_name("E,…");
  run_command->add_option("--record", run_options.record, "keep every frame, for `cutproof check` and ParaView")
      ->type_name("F");
  run_command->add_option("--json", run_options.json, "write verdicts, stage times and counts")->type_name("F");

  CheckOptions check_options;
  CLI::App* check_command = app.add_subcommand("check", "judge a recording");
  check_command->add_option("recording", check_options.recording, "what --record was given")
      ->required()
      ->type_name("RECORDING");
  check_command->add_option("--json", check_options.json, "write verdicts and counts")->type_name("F");

  InfoOptions info_options;
  CLI::App* info_command = app.add_subcommand("info", "version, backends, devices");
  info_command->add_flag("--scene", info_options.scene, "list every field of a scene file");

  const std::function<int()> bench = add_bench(app);

  TuneOptions tune_options;
  CLI::App* tune_command = app.add_subcommand("tune", "find the cheapest configuration of a scene within a tolerance");
  tune_command->add_option("scene", tune_options.scene, "scene file (JSON); see `cutproof info --scene`")
      ->required()
      ->type_name("SCENE");
  tune_command
      ->add_option("--tolerance", tune_options.tolerance, "greatest RMS distance from the answer in any frame [h]")
      ->required()
      ->type_name("T")
      ->check(CLI::PositiveNumber);
  tune_command
      ->add_option("--answer", tune_options.answer,
                   "limit: of ever shorter time steps; substeps: the scene's own, each solved until it is converged")
      ->capture_default_str()
      ->type_name("A")
      ->check(CLI::IsMember({"limit", "substeps"}));
  add_backend(*tune_command, tune_options.backend, "who is timed; `cutproof info` lists them");
  tune_command->add_option("--frames", tune_options.frames, "look at so many frames of the scene only")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  tune_command->add_flag("--without-skin", tune_options.without_skin, "nobody looks at the skin: it need not be made");
  tune_command->add_flag(
      "--full", tune_options.full,
      "run and time everything to its end, for a curve; else what is beyond the tolerance, or dearer "
      "than what was found, is given up");
  tune_command->add_option("--repeats", tune_options.repeats, "timed runs of each configuration")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  tune_command->add_option("--write", tune_options.write, "the scene that was found (default: NAME_tuned.json here)")
      ->type_name("F");
  tune_command->add_option("--json", tune_options.json, "write everything that was tried")->type_name("F");

  FuzzOptions fuzz_options;
  CLI::App* fuzz_command = app.add_subcommand("fuzz", "random dissections until one is wrong, and that one simplified");
  add_backend(*fuzz_command, fuzz_options.backend, "whom to find faults in; `cutproof info` lists them");
  fuzz_command->add_option("--cases", fuzz_options.cases, "how many (default: 1000)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  fuzz_command->add_option("--seconds", fuzz_options.seconds, "for how long")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  fuzz_command->add_option("--seed", fuzz_options.seed, "what cases are drawn from")
      ->capture_default_str()
      ->type_name("N");
  fuzz_command->add_option("--sizes", fuzz_options.sizes, "least and greatest size of a case, within 0-110")
      ->capture_default_str()
      ->type_name("A-B");
  fuzz_command->add_flag("--dynamics", fuzz_options.dynamics, "bodies move and blades push what they cut");
  fuzz_command->add_option("--batch", fuzz_options.batch, "bodies in one load (default: 16 for the reference, else 64)")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000));
  fuzz_command->add_option("--threads", fuzz_options.threads, "that generate and judge (default: all)")
      ->type_name("N")
      ->check(CLI::Range(1, 4096));
  fuzz_command->add_option("--shard", fuzz_options.shard, "only part i of N of the cases")->type_name("i/N");
  fuzz_command->add_flag("--keep-going", fuzz_options.keep_going, "beyond the first violation");
  fuzz_command->add_option("--save", fuzz_options.save, "folder for counterexamples")
      ->capture_default_str()
      ->type_name("DIR");
  fuzz_command->add_option("--json", fuzz_options.json, "write counts, classes and violations")->type_name("F");
  fuzz_command->add_option("--merge", fuzz_options.merge, "put the results of all shards together; runs nothing")
      ->type_name("JSON...");

  ReplayOptions replay_options;
  BackendChoice replay_backend;
  replay_backend.name.clear();
  CLI::App* replay_command = app.add_subcommand("replay", "run a counterexample again");
  replay_command->add_option("counterexample", replay_options.counterexample, "what `cutproof fuzz` has saved")
      ->required()
      ->type_name("CASE");
  add_backend(*replay_command, replay_backend, "on whom (default: where it was found)");
  replay_command->add_option("--record", replay_options.record, "keep every frame, for `cutproof check` and ParaView")
      ->type_name("F");

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    if (argc <= 1) {
      std::fputs(app.help().c_str(), stderr);
    } else {
      app.exit(error);
    }
    return 2;
  }
  if (run_command->parsed()) {
    if (run_options.scene.empty()) {
      std::fputs(kNextSteps, stderr);
      return 2;
    }
    return run(run_options);
  }
  if (check_command->parsed()) return check(check_options);
  if (info_command->parsed()) return info(info_options);
  if (tune_command->parsed()) return tune(tune_options);
  if (fuzz_command->parsed()) return fuzz(fuzz_options);
  if (replay_command->parsed()) {
    if (!replay_backend.name.empty()) replay_options.backend = replay_backend;
    return replay(replay_options);
  }
  return bench();
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(end_with_status);
  try {
    return run_command_line(argc, argv);
  } catch (...) {
    return status_of_exception();
  }
}
