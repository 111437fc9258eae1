#include "cli/bench/suites.h"
#include "cli/interruption.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

void print_row_of_campaigns(const json& document) {
  const json& row = document.at("rows").back();
  say_filled("{campaign}, {backend}: {cases_per_second:.0f} cases/s\n", row);
}

// Of the time of all threads.
std::string share(const json& row, const char* what) {
  double sum = 0;
  for (const json& seconds : row.at("thread_seconds")) sum += seconds.get<double>();
  return sum > 0 ? fmt::format("{:.0f} %", 100 * row.at("thread_seconds").at(what).get<double>() / sum) : "-";
}

void print_campaigns(const json& document) {
  std::vector<Column> columns = {{"campaign", "{campaign}"},
                                 {"backend", "{backend}"},
                                 {"devices", [](const json& row) { return std::to_string(row.at("devices").size()); }},
                                 {"particles", "{mean_particles:.0f}"},
                                 {"batch", "{batch}"},
                                 {"threads", "{threads}"},
                                 {"cases/s", "{cases_per_second:.4g}"},
                                 {"of reference", "{of_reference:.2f}"}};
  for (const char* const part : {"generating", "simulating", "reference", "judging", "waiting"}) {
    columns.push_back({part, [part](const json& row) { return share(row, part); }});
  }
  columns.push_back({"verdicts a case", [](const json& row) {
                       const double cases = row.at("cases").get<double>();
                       return cases > 0 ? fmt::format("{:.1f}", row.at("error").at("verdicts").get<double>() / cases)
                                        : "-";
                     }});
  columns.push_back({"violations", "{error/violations}"});
  columns.push_back({"undecided", "{error/undecided} of {error/checked}"});
  columns.push_back({"max h", "{error/greatest_h:.2g}"});
  say_as_it_is("\n" + table_of(document.at("rows"), columns, 2));
  say("shares are of the time of all threads: simulating is what they wait for a device, too; max h: greatest distance "
      "of a position after a step from the reference's\n");
}

}  // namespace

void add_campaigns(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::CampaignsOptions>();
  options->stop_asked = stop_asked;
  CLI::App* const command =
      bench.add_subcommand("campaigns", "cases a second of `fuzz`, and where their time goes, beside the reference's");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_list(*command, "--kinds", options->kinds, "small, large and moving cases", "K");
  command->add_option("--seconds", options->seconds, "of each campaign")
      ->capture_default_str()
      ->type_name("S")
      ->check(number_from(0));
  add_count(*command, "--cases", options->cases, "of each campaign, however long they take",
            whole_number(1, 1'000'000'000));
  add_seed(*command, options->seed, "what cases are drawn from");
  add_count(*command, "--batch", options->batch, "bodies in one load (default: by backend and size)",
            whole_number(1, 100'000));
  add_count(*command, "--threads", options->threads, "that generate and judge (default: all)", whole_number(1, 4096));
  add_devices(*command, options->devices);
  add_suite(*command, work, "write rates, times and what was compared",
            {.run = [options](const auto& progress) { return run_campaigns(*options, progress); },
             .row = print_row_of_campaigns,
             .end = print_campaigns});
}

}  // namespace cutproof::cli
