#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_seed(const nlohmann::json& document) { say_filled("seed {seed}\n", document); }

void print_baselines(const nlohmann::json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kBaselinesSuite)) + "\n");
  say("ideal: the least loss of tissue when particles are removed; a blade without thickness would lose "
      "none.\nDeletion is emulated beside the backend: its time is that of step, detect and skin.\n");
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
  add_suite(*command, work, "write times and errors as JSON",
            {.run = [options](const auto& progress) { return run_baselines(*options, progress); },
             .begin = print_seed,
             .end = print_baselines});
}

}  // namespace cutproof::cli
