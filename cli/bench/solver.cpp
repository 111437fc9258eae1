#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_entry(const nlohmann::json& document) {
  const nlohmann::json& entry = document.at("scenes").back();
  say_filled("\n{scene}: {particles} particles, {clusters} clusters; k = {stiffness:g}, {substeps} substep", entry);
  say("{}", entry.at("substeps") == 1 ? "" : "s");
  say_filled(" of {1e3*substep_seconds:g} ms", entry);
  say_filled("; {precision} precision", document);
  say("{}\n", entry.at("converged") ? "" : "; NO converged solution was found, errors are from the last alternation");
  say_as_it_is(table_of(entry.at("rows"), columns_of(report::kSolverSuite)));
  for (const nlohmann::json& least : entry.at("to_tolerance")) {
    say_filled("  {tolerance_h:g} h: ", document);
    say_filled("{acceleration} after {iterations} iterations, {1e3*seconds:.4f} ms\n", least);
  }
}

}  // namespace

void add_solver(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::SolverOptions>();
  CLI::App* const command = bench.add_subcommand("solver", "error of the step by iterations, plain and accelerated");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_list(*command, "--stiffness", options->stiffness, "k [1/s²]", "K");
  add_list(*command, "--substeps", options->substeps, "substeps of the frame of 4 ms");
  add_list(*command, "--iterations", options->iterations, "iterations of a substep");
  command
      ->add_option("--particles", options->particles,
                   "particles of a second body; 0: the block alone (default: 2000; on a device 101096)")
      ->type_name("N")
      ->check(whole_number(0));
  command->add_option("--tolerance", options->tolerance, "greatest acceptable error [h]")
      ->capture_default_str()
      ->type_name("H")
      ->check(number_above(0));
  add_count(*command, "--samples", options->samples, "timed steps of each row", whole_number(1, 10'000));
  add_suite(*command, work, "write every row as JSON",
            {.run = [options](const auto& progress) { return run_solver(*options, progress); },
             .row = print_entry,
             .rows = "scenes"});
}

}  // namespace cutproof::cli
