#include <optional>

#include "cli/bench/suites.h"
#include "cli/interruption.h"
#include "model/stop.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

struct AskedRotations : benchmarks::RotationsOptions {
  bool cases = false;  // a table of every case, too
};

// One line for each case: the worst gap, and how many are wrong, of each method.
void print_cases(const json& document, const std::string& precision) {
  std::vector<Column> columns = {{precision + ": worst gap (wrong)", "{name}"}};
  for (const json& method : document.at("methods")) {
    if (method.at("precision") != precision) continue;
    columns.emplace_back(method.at("method"), [&](const json& hard_case) {
      for (const json& row : document.at("rows")) {
        if (row.at("method") != method.at("method") || row.at("precision") != precision ||
            row.at("case") != hard_case.at("name")) {
          continue;
        }
        return io::filled(row.at("wrong") > 0 ? "{worst_gap:.1e} ({wrong})" : "{worst_gap:.1e}", row);
      }
      return std::string();
    });
  }
  say_as_it_is("\n" + table_of(document.at("cases"), columns));
}

// One line for each method.
void print_methods(const json& document) {
  say_as_it_is("\n" + table_of(document.at("methods"), columns_of(report::kRotationsSuite), 2));
}

void print_what_is_wrong(const json& document) {
  say("\nTimes are of a million matrices, near the answer ({} rad) and from the identity.", benchmarks::kNearTurn);
  say_filled(
      " An answer is wrong beyond a "
      "gap of {single/gap:.1e} or ‖RᵀR - I‖ = {single/orthogonality:.1e} (double: {double/gap:.1e}, "
      "{double/orthogonality:.1e}), or where the case expects another. The best values "
      "that answers are compared with are certain to {single/reference_error:.1e} (double: "
      "{double/reference_error:.1e}).\n",
      document.at("bounds"));
  for (const json& method : document.at("methods")) {
    if (!method.at("default")) continue;
    say_filled("The default, {method} in {precision} precision, is wrong in {wrong} of {answers} answers.\n", method);
    for (const json& row : document.at("rows")) {
      if (row.at("method") != method.at("method") || row.at("precision") != method.at("precision")) continue;
      if (row.at("wrong") > 0) insist_text(io::filled("  FAILS: {case}: {first_wrong}\n", row));
    }
  }
}

void print_begin(const json& document) {
  say_filled(
      "{matrices} matrices of each case, {timed} timed {repeats} times, seed {seed}; copy, read + written: "
      "{1e-9*machine_limits/copy_bytes_per_second:.4g} GB/s\n",
      document);
}

}  // namespace

void add_rotations(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<AskedRotations>();
  CLI::App* const command =
      bench.add_subcommand("rotations", "methods for the rotation of a cluster, on every hard case");
  add_backend_name(*command, asked->backend, "where", is_timed);
  add_count(*command, "--matrices", asked->counts.matrices, "matrices of each case", whole_number(1, 10'000'000));
  add_count(*command, "--timed", asked->timed, "matrices timed together (default: 20000; on a device 1000000)",
            whole_number(1, 100'000'000));
  add_count(*command, "--repeats", asked->counts.repeats, "repeats of each timing, after a warm-up",
            whole_number(1, 10'000));
  add_seed(*command, asked->counts.seed, "seed, added to those of the cases");
  command->add_flag("--cases", asked->cases, "also print the worst gap of every case");
  const auto run = [asked](const benchmarks::Progress& found) {
    std::optional<Progress> progress;
    return run_rotations(*asked, found, [&](int64_t cases_begun, const std::string& what) {
      throw_if_asked(stop_asked);
      if (!progress) progress.emplace("case", static_cast<int64_t>(fixtures::hard_cases().size()));
      progress->show(cases_begun, what);
    });
  };
  const auto print = [asked](const json& document) {
    if (asked->cases) {
      for (const char* const precision : {"single", "double"}) print_cases(document, precision);
    }
    print_methods(document);
    print_what_is_wrong(document);
  };
  add_suite(*command, work, "write errors, times and limits as JSON",
            {.run = run, .begin = print_begin, .end = print, .rows = "methods"});
}

}  // namespace cutproof::cli
