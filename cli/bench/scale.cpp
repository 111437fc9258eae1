#include "benchmarks/suites/scale.h"

#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::ScaleOptions;
using benchmarks::ScaleResult;
using benchmarks::ScaleRow;

void print_table(const ScaleResult& result) {
  Table table(joined({{"median ms", "particles", "clusters"},
                      scene_time_names(),
                      {"M particles/s", "MB", "B/particle"},
                      scene_error_names()}));
  for (const ScaleRow& row : result.rows) {
    const auto bytes = static_cast<double>(row.bytes.value_or(0)), particles = static_cast<double>(row.scene.particles);
    table.add(joined(
        {scene_counts(row.scene),
         scene_times(row.scene),
         {fmt::format("{:.4g}", 1e-6 * row.particles_per_second), row.bytes ? fmt::format("{:.4g}", 1e-6 * bytes) : "-",
          row.bytes ? fmt::format("{:.0f}", bytes / particles) : "-"},
         scene_errors(row.scene)}));
  }
  fmt::print("\n{}", table.text());
}

int scale(const Asked<ScaleOptions>& asked) {
  require_writable(asked.json);
  const ScaleResult result = benchmarks::run_scale(
      asked, reporting<ScaleResult>(asked.json, kNothing,
                                    [](const ScaleResult& so_far) { print_scene(so_far.rows.back().scene); }));
  print_table(result);
  return conclude_suite(asked.json, result.rows.size(), result.holds());
}

}  // namespace

void add_scale(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<ScaleOptions>>();
  CLI::App* const command =
      bench.add_subcommand("scale", "a frame, its stages and its memory from a thousand particles to ten million");
  add_timing(*command, *asked);
  command
      ->add_option("--sizes", asked->sizes,
                   "particles, separated by commas (default: 1000 to 10000; on a device to 10000000)")
      ->delimiter(',')
      ->type_name("N,N...");
  add_json(*command, asked->json, "write times and errors");
  command->callback([asked, &work] { work = [asked] { return scale(*asked); }; });
}

}  // namespace cutproof::cli
