#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_sampling(const nlohmann::json& document) {
  const bool whole = document.at("scaled_down") == 1;
  const auto to_first = [](const nlohmann::json& of) {
    const nlohmann::json& ratio = of.at("frame_to_first");
    return ratio.is_null() ? "-" : percent(ratio.get<double>() - 1);
  };
  print_scenes(document, {{"paper's", whole ? "{paper/clusters}" : "-"}},
               {{"to first", to_first},
                {"paper ms", "{1e3*paper/frame_seconds:.2f}"},
                {"to first", [&](const nlohmann::json& row) { return to_first(row.at("paper")); }}});
  if (!whole) say_filled("at 1/{scaled_down} of the paper's particles; --full takes them all\n", document);
}

}  // namespace

void add_sampling(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::SamplingOptions>();
  CLI::App* const command = bench.add_subcommand("sampling", "the cut of a kidney at the samplings of Tables 2 and 3");
  add_timing(*command, *options);
  command->add_option("--clusters", options->cooking, "how they are cooked: boxes or sampled")
      ->capture_default_str()
      ->type_name("C")
      ->check(one_of({"boxes", "sampled"}));
  command->add_flag("--full", options->full, "the paper's counts of particles, as always on a device");
  add_suite(*command, work, "write times and errors",
            {.run = [options](const auto& progress) { return run_sampling(*options, progress); },
             .row = print_scene,
             .end = print_sampling});
}

}  // namespace cutproof::cli
