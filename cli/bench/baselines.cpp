#include "benchmarks/suites/baselines.h"

#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::BaselinesOptions;
using benchmarks::BaselinesResult;

void print_table(const BaselinesResult& result) {
  Table table({"", "ms per frame", "isolated", "tissue/coupling/skin", "unequal frames", "lost/area [h]", "ideal [h]",
               "Hausdorff [h]", "interpenetration [h³]", "clusters"});
  const auto or_dash = [](const std::optional<double>& value) { return value ? fmt::format("{:.3g}", *value) : "-"; };
  for (const auto& [baseline, row] : result.rows) {
    table.add({baseline.name, fmt::format("{:.3g}", 1e3 * row.frame.median), fmt::format("{}", row.isolated),
               fmt::format("{}/{}/{}", row.end.components, row.end.couplings, row.end.shells),
               fmt::format("{} of {}", row.unequal_frames, row.frames), or_dash(row.geometry.lost_per_area),
               or_dash(row.geometry.least_per_area), or_dash(row.geometry.hausdorff()),
               fmt::format("{:.3g} ± {:.2g}", row.overlap.volume, row.overlap.bound),
               fmt::format("{} -> {}", row.clusters_before, row.clusters)});
  }
  fmt::print("\n{}\n", table.text());
  fmt::print(
      "ideal: the least that removing particles can lose; a blade without thickness would lose nothing.\n"
      "The two that delete are emulated beside the backend: their time is that of step, detect and skin.\n");
  if (!result.holds()) fmt::print("FAILS: this method left clusters isolated, or components that are not the same\n");
}

int baselines(const Asked<BaselinesOptions>& asked) {
  require_writable(asked.json);
  const auto print_seed = [](const BaselinesResult& begun) { fmt::print("seed {}\n", begun.seed); };
  const BaselinesResult result =
      benchmarks::run_baselines(asked, reporting<BaselinesResult>(asked.json, print_seed, kNothing));
  print_table(result);
  return conclude_suite(asked.json, result.rows.size(), result.holds());
}

}  // namespace

void add_baselines(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<BaselinesOptions>>();
  CLI::App* const command =
      bench.add_subcommand("baselines", "this method beside deletion, other expansion, detection and merging");
  add_backend_name(*command, asked->backend, "backend under test", is_timed);
  command->add_option("--particles", asked->particles, "of the kidney")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(int64_t{100}, int64_t{2'000'000}));
  command->add_option("--seed", asked->seed, "of the clusters")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  add_json(*command, asked->json, "write times and errors");
  command->callback([asked, &work] { work = [asked] { return baselines(*asked); }; });
}

}  // namespace cutproof::cli
