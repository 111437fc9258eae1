#include "benchmarks/suites/machine_limits.h"

#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::MachineLimit;
using benchmarks::MachineLimitsOptions;
using benchmarks::MachineLimitsResult;

void print_table(const MachineLimitsResult& result) {
  Table table({"", "median µs", "least", "most", "GB/s", "lost"});
  const auto microseconds = [](double seconds) { return fmt::format("{:.4g}", 1e6 * seconds); };
  for (const MachineLimit& row : result.rows) {
    table.add({row.what, microseconds(row.seconds.median), microseconds(row.seconds.min), microseconds(row.seconds.max),
               row.bytes > 0 ? fmt::format("{:.4g}", 1e-9 * row.bytes / row.seconds.median) : "-",
               row.lost ? fmt::format("{}", *row.lost) : "-"});
  }
  fmt::print("\n{}", table.text());
  if (!result.holds()) fmt::print("FAILS: something that was timed did not do its work\n");
}

int machine_limits(const Asked<MachineLimitsOptions>& asked) {
  require_writable(asked.json);
  const MachineLimitsResult result =
      benchmarks::run_machine_limits(asked, reporting<MachineLimitsResult>(asked.json, kNothing, kNothing));
  print_table(result);
  return conclude_suite(asked.json, result.rows.size(), result.holds());
}

}  // namespace

void add_machine_limits(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<MachineLimitsOptions>>();
  CLI::App* const command = bench.add_subcommand("machine_limits", "what the machine can do at best: copies, launches");
  add_backend_name(*command, asked->backend, "whose machine", is_timed);
  command->add_option("--repeats", asked->repeats, "of each timing")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  add_json(*command, asked->json, "write times");
  command->callback([asked, &work] { work = [asked] { return machine_limits(*asked); }; });
}

}  // namespace cutproof::cli
