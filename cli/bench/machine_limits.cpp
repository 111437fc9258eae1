#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

void print_machine_limits(const nlohmann::json& document) {
  const auto speed = [](const nlohmann::json& row) {
    return row.contains("bytes") ? io::filled("{1e-9*bytes_per_second:.4g}", row) : "-";
  };
  say_as_it_is("\n" + table_of(document.at("rows"), {{"", "{what}"},
                                                     {"median µs", "{1e6*seconds/median:.4g}"},
                                                     {"least", "{1e6*seconds/min:.4g}"},
                                                     {"most", "{1e6*seconds/max:.4g}"},
                                                     {"GB/s", speed},
                                                     {"lost", "{lost}"}}));
  if (!document.at("holds")) insist("FAILS: something that was timed did not do its work\n");
}

}  // namespace

void add_machine_limits(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::MachineLimitsOptions>();
  CLI::App* const command = bench.add_subcommand("machine_limits", "what the machine can do at best: copies, launches");
  add_backend_name(*command, options->backend, "whose machine", is_timed);
  add_count(*command, "--repeats", options->repeats, "of each timing", whole_number(1, 10'000));
  add_suite(*command, work, "write times",
            {.run = [options](const auto& progress) { return run_machine_limits(*options, progress); },
             .end = print_machine_limits});
}

}  // namespace cutproof::cli
