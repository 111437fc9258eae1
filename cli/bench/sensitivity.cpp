#include "cli/bench/suites.h"
#include "cli/interruption.h"
#include "model/io/verdict_json.h"

namespace cutproof::cli {

namespace {

// A size without a unit is relative.
std::string words_of(const nlohmann::json& unit) { return unit == "1" ? "relative" : unit.get<std::string>(); }

void print_row_of_sensitivity(const nlohmann::json& document) {
  const nlohmann::json& row = document.at("rows").back();
  say_filled("{scene}, {disturbance} after {stage}: ", row);
  if (row.at("least").is_null()) {
    say("nothing is rejected\n");
  } else {
    say("{} {}, {}\n", io::filled("{least:.2g}", row), words_of(row.at("unit")), io::filled("{property}", row));
  }
}

void print_sensitivity(const nlohmann::json& document) {
  say_as_it_is("\n" + table_of(document.at("rows"), columns_of(report::kSensitivitySuite), 3));
  say("least rejected: by bisection, at the most sensitive moment. its measured, of bound: the greatest value of that "
      "property over the undisturbed run. rounding: difference of the undisturbed run from the reference's stages.\n");
  for (const nlohmann::json& scene : document.at("scenes")) {
    for (const nlohmann::json& verdict : scene.at("failed")) {
      insist_text(io::filled("FAILS as it is: {property}: {witness/text}\n", verdict));
    }
  }
}

}  // namespace

void add_sensitivity(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::SensitivityOptions>();
  options->stop_asked = stop_asked;
  CLI::App* const command = bench.add_subcommand("sensitivity", "smallest disturbance that the judge of runs rejects");
  add_backend_name(*command, options->backend, "scenes whose runs are disturbed");
  add_count(*command, "--particles", options->particles, "particles of each scene", whole_number(100, 3000));
  add_count(*command, "--moments", options->moments, "moments of each stage, evenly over the run",
            whole_number(1, 1000));
  add_suite(*command, work, "write every row as JSON",
            {.run = [options](const auto& progress) { return run_sensitivity(*options, progress); },
             .row = print_row_of_sensitivity,
             .end = print_sensitivity});
}

}  // namespace cutproof::cli
