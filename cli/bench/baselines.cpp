#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_seed(const nlohmann::json& document) { say_filled("seed {seed}\n", document); }

void print_baselines(const nlohmann::json& document) {
  const std::vector<Column> columns = {
      {"", "{name}"},
      {"ms per frame", "{1e3*seconds/median:.3g}"},
      {"isolated", "{isolated}"},
      {"tissue/coupling/skin", "{components}/{couplings}/{shells}"},
      {"unequal frames", "{unequal_frames} of {frames}"},
      {"lost/area [h]", "{geometry/lost_per_area:.3g}"},
      {"ideal [h]", "{geometry/least_per_area:.3g}"},
      {"Hausdorff [h]", "{geometry/hausdorff:.3g}"},
      {"interpenetration [h³]", "{interpenetration/volume:.3g} ± {interpenetration/bound:.2g}"},
      {"clusters", "{clusters_before} -> {clusters}"}};
  say_as_it_is(fmt::format("\n{}\n", table_of(document.at("rows"), columns)));
  say("ideal: the least that removing particles can lose; a blade without thickness would lose nothing.\n"
      "The two that delete are emulated beside the backend: their time is that of step, detect and skin.\n");
  if (!document.at("holds")) {
    insist("FAILS: this method left clusters isolated, or components that are not the same\n");
  }
}

}  // namespace

void add_baselines(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::BaselinesOptions>();
  CLI::App* const command =
      bench.add_subcommand("baselines", "this method beside deletion, other expansion, detection and merging");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_count(*command, "--particles", options->particles, "of the kidney", whole_number(100, 2'000'000));
  add_seed(*command, options->seed, "of the clusters");
  add_suite(*command, work, "write times and errors",
            {.run = [options](const auto& progress) { return run_baselines(*options, progress); },
             .begin = print_seed,
             .end = print_baselines});
}

}  // namespace cutproof::cli
