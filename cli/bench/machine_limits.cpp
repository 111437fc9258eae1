#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_machine_limits(const nlohmann::json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kMachineLimitsSuite)));
  if (!document.at("holds")) insist("FAILS: a timed operation did not do its work\n");
}

}  // namespace

void add_machine_limits(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::MachineLimitsOptions>();
  CLI::App* const command = bench.add_subcommand("machine_limits", "limits of the machine: copies, launches");
  add_backend_name(*command, options->backend, "whose machine", is_timed);
  add_count(*command, "--repeats", options->repeats, "repeats of each timing", whole_number(1, 10'000));
  add_suite(*command, work, "write times",
            {.run = [options](const auto& progress) { return run_machine_limits(*options, progress); },
             .end = print_machine_limits});
}

}  // namespace cutproof::cli
