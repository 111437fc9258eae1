#include "benchmarks/suites/sampling.h"

#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::SamplingOptions;
using benchmarks::SamplingResult;
using benchmarks::SamplingRow;

std::string percent(double ratio) { return fmt::format("{:+.1f} %", 100 * (ratio - 1)); }

void print_table(const SamplingResult& result) {
  Table table(joined({{"median ms", "particles", "clusters", "paper's"},
                      scene_time_names(),
                      {"to first", "paper ms", "to first"},
                      scene_error_names()}));
  for (const SamplingRow& row : result.rows) {
    table.add(joined(
        {scene_counts(row.scene),
         {result.scaled_down == 1 ? fmt::format("{}", row.paper.clusters) : "-"},
         scene_times(row.scene),
         {percent(row.frame_to_first), fmt::format("{:.2f}", row.paper.frame_ms), percent(row.paper_frame_to_first)},
         scene_errors(row.scene)}));
  }
  fmt::print("\n{}", table.text());
  if (result.scaled_down > 1) {
    fmt::print("at 1/{} of the paper's particles; --full takes them all\n", result.scaled_down);
  }
}

int sampling(const Asked<SamplingOptions>& asked) {
  require_writable(asked.json);
  const SamplingResult result = benchmarks::run_sampling(
      asked, reporting<SamplingResult>(asked.json, kNothing,
                                       [](const SamplingResult& so_far) { print_scene(so_far.rows.back().scene); }));
  print_table(result);
  return conclude_suite(asked.json, result.rows.size(), result.holds());
}

}  // namespace

void add_sampling(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<SamplingOptions>>();
  CLI::App* const command = bench.add_subcommand("sampling", "the cut of a kidney at the four samplings of Table 2");
  add_timing(*command, *asked);
  command->add_option("--clusters", asked->cooking, "how they are cooked: boxes or sampled")
      ->capture_default_str()
      ->type_name("C");
  command->add_flag("--full", asked->full, "the paper's counts of particles, as always on a device");
  add_json(*command, asked->json, "write times and errors");
  command->callback([asked, &work] { work = [asked] { return sampling(*asked); }; });
}

}  // namespace cutproof::cli
