#include "benchmarks/suites/solver.h"

#include "cli/bench/suites.h"
#include "model/rules.h"

namespace cutproof::cli {

namespace {

using benchmarks::SolverCurve;
using benchmarks::SolverEntry;
using benchmarks::SolverOptions;
using benchmarks::SolverResult;

void print_entry(const SolverResult& so_far) {
  const SolverEntry& entry = so_far.scenes.back();
  fmt::print("\n{}: {} particles, {} clusters; k = {:g}, {} substep{} of {:g} ms; {} precision{}\n", entry.scene,
             entry.particles, entry.clusters, entry.stiffness, entry.substeps, entry.substeps == 1 ? "" : "s",
             1e3 * entry.substep_seconds, so_far.precision,
             entry.converged ? "" : "; NO converged solution was found, errors are from the last alternation");
  Table table({"acceleration", "iterations", "max h", "RMS h", "energy gap", "median ms"});
  for (const SolverCurve& curve : entry.curves) {
    for (const auto& [iterations, row] : curve.rows) {
      const benchmarks::SolverError& error = row.error;
      table.add({std::string(name_of(curve.acceleration)), fmt::format("{}", iterations),
                 fmt::format("{:.2g}", error.max_h), fmt::format("{:.2g}", error.rms_h),
                 error.energy_gap ? fmt::format("{:.1e}", *error.energy_gap) : "-",
                 fmt::format("{:.4f}", 1e3 * row.times.median)});
    }
  }
  fmt::print("{}", table.text());
  for (const SolverCurve& curve : entry.curves) {
    if (!curve.least) continue;
    fmt::print("  {:g} h: {} after {} iterations, {:.4f} ms\n", so_far.tolerance, name_of(curve.acceleration),
               *curve.least, 1e3 * curve.rows.at(*curve.least).times.median);
  }
}

int solver(const Asked<SolverOptions>& asked) {
  require_writable(asked.json);
  const SolverResult result = benchmarks::run_solver(asked, reporting<SolverResult>(asked.json, kNothing, print_entry));
  return conclude_suite(asked.json, result.scenes.size(), true);
}

}  // namespace

void add_solver(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<SolverOptions>>();
  CLI::App* const command =
      bench.add_subcommand("solver", "iterations of the step against its error, plain and accelerated");
  add_backend_name(*command, asked->backend, "backend under test", is_timed);
  command->add_option("--stiffness", asked->stiffness, "k [1/s²], separated by commas")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("K,K...");
  command->add_option("--substeps", asked->substeps, "of the frame of 4 ms, separated by commas")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("N,N...");
  command->add_option("--iterations", asked->iterations, "of a substep, separated by commas")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("N,N...");
  command
      ->add_option("--particles", asked->particles,
                   "of a second body; 0: the block alone (default: 2000; on a device 101096)")
      ->type_name("N");
  command->add_option("--tolerance", asked->tolerance, "greatest error that is asked for [h]")
      ->capture_default_str()
      ->type_name("H")
      ->check(CLI::PositiveNumber);
  command->add_option("--samples", asked->samples, "timed steps of each row")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  add_json(*command, asked->json, "write every row");
  command->callback([asked, &work] { work = [asked] { return solver(*asked); }; });
}

}  // namespace cutproof::cli
