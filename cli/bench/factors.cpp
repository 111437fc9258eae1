#include "benchmarks/suites/factors.h"

#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::FactorsOptions;
using benchmarks::FactorsResult;
using benchmarks::FactorsRow;
using benchmarks::FactorsScene;

void print_scene_rows(const FactorsResult& so_far) {
  const FactorsScene& scene = so_far.scenes.back();
  fmt::print("\n{}: {} particles, {} clusters\n", scene.scene, scene.particles, scene.clusters);
  Table table({"cut", "removed", "rows changed", "new", "way", "median ms", "least", "solve ms", "entries", "residual",
               "bound"});
  for (const FactorsRow& row : scene.rows) {
    table.add({row.cut, fmt::format("{}", row.removed), fmt::format("{}", row.changed_rows),
               fmt::format("{}", row.new_rows), name_of(row.way), ms(row.seconds),
               fmt::format("{:.4g}", 1e3 * row.seconds.min), ms(row.solve_seconds), fmt::format("{}", row.entries),
               fmt::format("{:.1e}", row.residual),
               fmt::format("{:.1e}{}", row.residual_bound, row.within() ? "" : " EXCEEDED")});
  }
  fmt::print("{}", table.text());
  fmt::print("  a converged substep: {:.4g} s, {} alternations{}\n", scene.substep_seconds, scene.alternations,
             scene.converged ? "" : ", NOT converged");
}

int factors(const Asked<FactorsOptions>& asked) {
  require_writable(asked.json);
  const FactorsResult result =
      benchmarks::run_factors(asked, reporting<FactorsResult>(asked.json, kNothing, print_scene_rows));
  return conclude_suite(asked.json, result.scenes.size(), result.holds());
}

}  // namespace

void add_factors(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<FactorsOptions>>();
  CLI::App* const command =
      bench.add_subcommand("factors", "a cut body's linear system: its factor updated, or made anew");
  command->add_option("--sides", asked->sides, "particles along a cube, clusters of cores of 5³")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("N,N...");
  command->add_option("--fine-sides", asked->fine_sides, "the same with many clusters, of cores of 2³")
      ->delimiter(',')
      ->capture_default_str()
      ->type_name("N,N...");
  command->add_option("--repeats", asked->repeats, "of each measurement")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  command->add_option("--seed", asked->seed, "of right-hand sides and velocities")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  add_json(*command, asked->json, "write every row");
  command->callback([asked, &work] { work = [asked] { return factors(*asked); }; });
}

}  // namespace cutproof::cli
