#include "cli/bench/suites.h"
#include "cli/interruption.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

void print_row_of_campaigns(const json& document) {
  const json& row = document.at("rows").back();
  say_filled("{campaign}, {backend}: {cases_per_second:.0f} cases/s\n", row);
}

void print_campaigns(const json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kCampaignsSuite), 2));
  say("shares: of the time of all threads; simulating includes waiting for a device; max [h]: greatest distance of a "
      "position after a step from the reference's\n");
}

}  // namespace

void add_campaigns(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::CampaignsOptions>();
  options->stop_asked = stop_asked;
  CLI::App* const command =
      bench.add_subcommand("campaigns", "cases per second of `fuzz`, and shares of its phases, beside the reference's");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_list(*command, "--kinds", options->kinds, "kinds of cases: small, large, moving", "K");
  command->add_option("--seconds", options->seconds, "seconds of each campaign")
      ->capture_default_str()
      ->type_name("S")
      ->check(number_from(0));
  add_count(*command, "--cases", options->cases, "cases of each campaign, instead of a time",
            whole_number(1, 1'000'000'000));
  add_seed(*command, options->seed, "seed of the cases");
  add_count(*command, "--batch", options->batch, "bodies in a batch (default: by backend and size)",
            whole_number(1, 100'000));
  add_count(*command, "--threads", options->threads, "threads that generate and judge (default: all)",
            whole_number(1, 4096));
  add_devices(*command, options->devices);
  add_suite(*command, work, "write rates, times and comparisons as JSON",
            {.run = [options](const auto& progress) { return run_campaigns(*options, progress); },
             .row = print_row_of_campaigns,
             .end = print_campaigns});
}

}  // namespace cutproof::cli
