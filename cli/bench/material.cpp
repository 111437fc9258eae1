#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_row_of_material(const nlohmann::json& document) {
  say_filled(
      "{along}, side {side}, ν = {poisson_ratio}, {across} across, {test}: {quantity} {measured:.4g} for {asked:.4g}\n",
      document.at("rows").back());
}

void print_material(const nlohmann::json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kMaterialSuite), 1));
  say("bars of 10 kPa, five times as long as they are thick; K: given iterations, which are asked for (1 - λ) E\n");
}

}  // namespace

void add_material(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::MaterialOptions>();
  CLI::App* const command = bench.add_subcommand(
      "material", "bars of a material that hang, stretch, twist, bend and swing, beside closed forms");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_list(*command, "--along", options->along, "axes of bars in the grid: 100, 110, 111", "A");
  add_list(*command, "--clusters", options->cooking, "methods of cooking: tiles, boxes, sampled", "C");
  add_list(*command, "--sides", options->sides, "side of clusters: edges of a tile, nodes of a core", "N");
  add_list(*command, "--poisson-ratio", options->poisson_ratios, "Poisson's ratios", "NU");
  add_list(*command, "--across", options->across, "nodes across a bar", "N");
  add_list(*command, "--iterations", options->iterations, "few iterations, a row each", "K");
  add_suite(*command, work, "write what was asked and measured as JSON",
            {.run = [options](const auto& progress) { return run_material(*options, progress); },
             .row = print_row_of_material,
             .end = print_material});
}

}  // namespace cutproof::cli
