#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_sampling(const nlohmann::json& document) {
  print_scenes(document, report::kSamplingSuite);
  if (document.at("scaled_down") > 1)
    say_filled("at 1/{scaled_down} of the paper's particles; --full takes them all\n", document);
}

}  // namespace

void add_sampling(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::SamplingOptions>();
  CLI::App* const command = bench.add_subcommand("sampling", "cut of a kidney at the samplings of Tables 2 and 3");
  add_timing(*command, *options);
  command->add_option("--clusters", options->cooking, "methods of cooking: boxes, sampled")
      ->capture_default_str()
      ->type_name("C")
      ->check(one_of({"boxes", "sampled"}));
  command->add_flag("--full", options->full, "the paper's particle counts, the default on a device");
  add_suite(*command, work, "write times and errors as JSON",
            {.run = [options](const auto& progress) { return run_sampling(*options, progress); },
             .row = print_scene,
             .end = print_sampling});
}

}  // namespace cutproof::cli
