#include "benchmarks/suites/rotations.h"

#include "benchmarks/contenders.h"
#include "cli/bench/suites.h"
#include "cli/terminal.h"

namespace cutproof::cli {

namespace {

using benchmarks::RotationCaseResult;
using benchmarks::RotationReport;
using benchmarks::RotationResult;
using benchmarks::RotationsOptions;
using benchmarks::RotationsResult;

struct AskedRotations : Asked<RotationsOptions> {
  bool cases = false;  // a table of every case, too
};

std::string milliseconds(double seconds) { return fmt::format("{:.4g}", 1e3 * seconds); }

// One line for each method.
void print_methods(const RotationReport& report) {
  Table table({"method", "precision", "worst gap", "in case", "‖RᵀR - I‖", "wrong", "NaN", "near ms", "least", "most",
               "cold ms", "× limit", ""});
  for (const RotationResult& r : report.results) {
    std::string marks = r.on_front ? "front" : "";
    if (r.is_default) marks += marks.empty() ? "default" : ", default";
    table.add({r.method, benchmarks::name_of(r.precision), fmt::format("{:.1e}", r.worst_gap), r.worst_case,
               fmt::format("{:.1e}", r.worst_orthogonality), fmt::format("{}", r.wrong),
               fmt::format("{}", r.not_finite), milliseconds(r.near.median), milliseconds(r.near.min),
               milliseconds(r.near.max), milliseconds(r.cold.median), fmt::format("{:.1f}", r.near.median / r.limit),
               marks});
  }
  fmt::print("\n{}", table.text());
}

// One line for each case: the worst gap, and how many are wrong, of each method.
void print_cases(const RotationReport& report, Precision precision) {
  std::vector<const RotationResult*> columns;
  std::vector<std::string> head = {std::string(benchmarks::name_of(precision)) + ": worst gap (wrong)"};
  for (const RotationResult& r : report.results) {
    if (r.precision != precision) continue;
    columns.push_back(&r);
    head.push_back(r.method);
  }
  Table table(head);
  const auto& cases = fixtures::hard_cases();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    std::vector<std::string> row = {cases[k].name};
    for (const RotationResult* r : columns) {
      const fixtures::Judged& judged = r->cases[k].judged;
      std::string cell = judged.worst_gap ? fmt::format("{:.1e}", *judged.worst_gap) : "-";
      if (judged.wrong > 0) cell += fmt::format(" ({})", judged.wrong);
      row.push_back(cell);
    }
    table.add(row);
  }
  fmt::print("\n{}", table.text());
}

void print_begin(const RotationsResult& result) {
  fmt::print("{} matrices of each case, {} timed {} times, seed {}; copy, read + written: {:.4g} GB/s\n",
             result.counts.matrices, result.counts.timed, result.counts.repeats, result.counts.seed,
             1e-9 * result.machine.copy_bytes_per_second);
}

void print_what_is_wrong(const RotationReport& report) {
  const fixtures::RotationBounds single = fixtures::rotation_bounds(Precision::binary32),
                                 twice = fixtures::rotation_bounds(Precision::binary64);
  fmt::print(
      "\nTimes are of a million matrices, near the answer ({} rad) and from the identity. An answer is wrong beyond a\n"
      "gap of {:.1e} or ‖RᵀR - I‖ = {:.1e} (double: {:.1e}, {:.1e}), or where the case expects another. The best "
      "values\n"
      "that answers are compared with are certain to {:.1e} (double: {:.1e}).\n",
      benchmarks::kNearTurn, single.gap, single.orthogonality, twice.gap, twice.orthogonality,
      report.reference_error_single, report.reference_error_double);
  for (const RotationResult& r : report.results) {
    if (!r.is_default) continue;
    fmt::print("The default, {} in {} precision, is wrong in {} of {} answers.\n", r.method,
               benchmarks::name_of(r.precision), r.wrong, r.answers);
    for (const RotationCaseResult& entry : r.cases) {
      if (entry.judged.wrong > 0) fmt::print("  FAILS: {}: {}\n", entry.name, entry.judged.first_wrong);
    }
  }
}

int rotations(const AskedRotations& asked) {
  require_writable(asked.json);
  std::optional<Progress> progress;
  const auto show = [&](int64_t cases_begun, const std::string& what) {
    if (!progress) progress.emplace("case", static_cast<int64_t>(fixtures::hard_cases().size()));
    progress->show(cases_begun, what);
  };
  const RotationsResult result =
      benchmarks::run_rotations(asked, reporting<RotationsResult>(asked.json, print_begin, kNothing), show);
  progress.reset();
  if (asked.cases) {
    for (const Precision precision : {Precision::binary32, Precision::binary64}) print_cases(result.report, precision);
  }
  print_methods(result.report);
  print_what_is_wrong(result.report);
  return conclude_suite(asked.json, result.report.results.size(), result.holds());
}

}  // namespace

void add_rotations(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<AskedRotations>();
  CLI::App* const command =
      bench.add_subcommand("rotations", "methods for the rotation of a cluster, on every hard case");
  add_backend_name(*command, asked->backend, "where", is_timed);
  command->add_option("--matrices", asked->counts.matrices, "of each case")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 10'000'000));
  command->add_option("--timed", asked->timed, "matrices that are timed together (default: 20000; on a device 1000000)")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000'000));
  command->add_option("--repeats", asked->counts.repeats, "of each timing, after one that does not count")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  command->add_option("--seed", asked->counts.seed, "added to the seeds of the cases")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--cases", asked->cases, "print the worst gap in every case as well");
  add_json(*command, asked->json, "write errors, times and limits");
  command->callback([asked, &work] { work = [asked] { return rotations(*asked); }; });
}

}  // namespace cutproof::cli
