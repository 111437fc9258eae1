#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_factors(const nlohmann::json& document) {
  const nlohmann::json& scene = document.at("scenes").back();
  const auto bound = [](const nlohmann::json& row) {
    const bool within = row.at("residual") <= row.at("residual_bound");
    return io::filled(within ? "{residual_bound:.1e}" : "{residual_bound:.1e} EXCEEDED", row);
  };
  say_filled("\n{scene}: {particles} particles, {clusters} clusters\n", scene);
  say_as_it_is(table_of(scene.at("rows"),
                        {{"cut", "{cut}"},
                         {"way", "{way}"},
                         {"removed", "{removed}"},
                         {"rows changed", "{changed_rows}"},
                         {"new", "{new_rows}"},

                         {"median ms", "{1e3*seconds/median:.4g}"},
                         {"least", "{1e3*seconds/min:.4g}"},
                         {"solve ms", "{1e3*solve_seconds/median:.4g}"},
                         {"entries", "{entries}"},
                         {"residual", "{residual:.1e}"},
                         {"bound", bound}},
                        2));
  const nlohmann::json& substep = scene.at("converged_substep");
  say_filled("  a converged substep: {seconds:.4g} s, {alternations} alternations", substep);
  say("{}\n", substep.at("converged") ? "" : ", NOT converged");
}

}  // namespace

void add_factors(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::FactorsOptions>();
  CLI::App* const command =
      bench.add_subcommand("factors", "a cut body's linear system: its factor updated, or made anew");
  add_list(*command, "--sides", options->sides, "particles along a cube, clusters of cores of 5³");
  add_list(*command, "--fine-sides", options->fine_sides, "the same with many clusters, of cores of 2³");
  add_count(*command, "--repeats", options->repeats, "of each measurement", whole_number(1, 1000));
  add_seed(*command, options->seed, "of right-hand sides and velocities");
  add_suite(*command, work, "write every row",
            {.run = [options](const auto& progress) { return run_factors(*options, progress); },
             .row = print_factors,
             .rows = "scenes"});
}

}  // namespace cutproof::cli
