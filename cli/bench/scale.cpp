#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_scale(const nlohmann::json& document) { print_scenes(document, report::kScaleSuite); }

}  // namespace

void add_scale(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::ScaleOptions>();
  CLI::App* const command =
      bench.add_subcommand("scale", "times and memory of a frame, from a thousand to ten million particles");
  add_timing(*command, *options);
  command
      ->add_option("--sizes", options->sizes,
                   "particles, separated by commas (default: 1000 to 10000; on a device to 10000000)")
      ->delimiter(',')
      ->type_name("N,N...")
      ->check(whole_number(1));
  add_suite(*command, work, "write times and errors as JSON",
            {.run = [options](const auto& progress) { return run_scale(*options, progress); },
             .row = print_scene,
             .end = print_scale});
}

}  // namespace cutproof::cli
