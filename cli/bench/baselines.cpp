#include "cli/bench/suites.h"
#include "cli/output.h"

namespace cutproof::cli {

namespace {

void print_seed(const nlohmann::json& document) { say_filled("seed {seed}\n", document); }

void print_baselines(const nlohmann::json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kBaselinesSuite)) + "\n");
  say("ideal: the least loss of tissue when particles are removed; a blade without thickness would lose "
      "none.\nDeletion is emulated beside the backend: its time is that of step, detect and skin.\n");
  if (document.contains("methods")) {
    say_as_it_is("\n" + table_of(document.at("methods"), columns_of(report::kMethodsOfBaselines)) + "\n");
    say("s/s: computing time of a simulated second. error: RMS distance from the converged solution before the cut, as "
        "a share of its displacement. felt: share of a kick of a free piece that what is held feels.\n");
  }
  if (!document.at("holds")) {
    insist("FAILS: this method left isolated clusters or unequal components\n");
  }
}

}  // namespace

void add_baselines(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::BaselinesOptions>();
  CLI::App* const command = bench.add_subcommand(
      "baselines", "compare this method with deletion and with other expansion, detection and merging");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_count(*command, "--particles", options->particles, "particles of the kidney", whole_number(100, 2'000'000));
  add_seed(*command, options->seed, "seed of the clusters");
  command->add_option("--with", options->with,
                      "simulators beside this one (Table 3): plugins FILE.so or FILE.so,PARAMETERS with 'dissect'");
  command->add_option("--sizes", options->sizes, "particles of the kidneys that they cut")
      ->delimiter(',')
      ->check(whole_number(100, 2'000'000));
  command->add_option("--truth", options->truth,
                      "plugin whose finer kidney is the converged solution, from which errors are measured");
  add_count(*command, "--truth-particles", options->truth_particles, "particles of the finer kidney",
            whole_number(100, 2'000'000));
  command->add_option("--youngs-modulus", options->youngs_modulus, "of the kidney [Pa]")->check(CLI::Range(1.0, 1e9));
  command->add_option("--iterations", options->iterations, "of this method, a row each")
      ->delimiter(',')
      ->check(whole_number(1, 1000));
  command->add_option("--save", options->save, "folder in which their runs are kept, for `cutproof check`");
  command->add_flag("!--no-kicks", options->kicks, "kick no piece");
  add_suite(*command, work, "write times and errors as JSON",
            {.run =
                 [options](const auto& progress) {
                   if (!options->save.empty()) make_folder("--save", options->save);
                   return run_baselines(*options, progress);
                 },
             .begin = print_seed,
             .end = print_baselines});
}

}  // namespace cutproof::cli
