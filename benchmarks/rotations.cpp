#include "benchmarks/rotations.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "benchmarks/machine_limits.h"
#include "benchmarks/suites.h"
#include "cli/json_number.h"
#include "cli/terminal.h"
#include "harness/backends.h"

namespace cutproof::cli {

namespace {

using fixtures::Precision;
using nlohmann::json;

// What counts as near the answer [rad]: an ordinary substep turns a cluster by less.
constexpr double kNearTurn = 0.02;
constexpr double kColdStart = -1;

std::string name_of(Precision precision) { return precision == Precision::single ? "single" : "double"; }

Times per_million(const RotationMethod& method, const fixtures::Frame& frame, int repeats) {
  std::vector<double> seconds = method.solve(frame.a, frame.previous, repeats).seconds;
  for (double& value : seconds) value *= 1e6 / static_cast<double>(frame.a.size());
  return times_of(std::move(seconds));
}

void sum_up(RotationResult& result) {
  for (const RotationCaseResult& entry : result.cases) {
    const fixtures::Judged& judged = entry.judged;
    result.answers += judged.answers;
    result.wrong += judged.wrong;
    result.not_finite += judged.not_finite;
    result.flagged += judged.flagged;
    result.worst_orthogonality = std::max(result.worst_orthogonality, judged.worst_orthogonality);
    result.worst_deviation = std::max(result.worst_deviation, judged.worst_deviation);
    if (judged.worst_gap && (result.worst_case.empty() || *judged.worst_gap > result.worst_gap)) {
      result.worst_gap = *judged.worst_gap;
      result.worst_case = entry.name;
    }
  }
}

json to_json(const std::optional<double>& value) { return value ? json_number(*value) : json(nullptr); }

}  // namespace

bool RotationReport::default_holds() const {
  return std::any_of(results.begin(), results.end(), [](const auto& r) { return r.is_default; }) &&
         std::all_of(results.begin(), results.end(), [](const auto& r) { return !r.is_default || r.wrong == 0; });
}

void mark_front(std::vector<RotationResult>& results) {
  // A method with answers that are not finite has no worst gap.
  const auto gap = [](const RotationResult& r) {
    return r.not_finite > 0 ? std::numeric_limits<double>::infinity() : r.worst_gap;
  };
  for (RotationResult& one : results) {
    one.on_front = std::none_of(results.begin(), results.end(), [&](const RotationResult& other) {
      const bool better = gap(other) < gap(one) || other.near.median < one.near.median;
      return other.precision == one.precision && better && gap(other) <= gap(one) &&
             other.near.median <= one.near.median;
    });
  }
}

RotationReport measure_rotations(const std::vector<RotationMethod>& methods, const RotationCounts& counts,
                                 const std::string& default_name, double copy_bytes_per_second) {
  RotationReport report;
  for (const RotationMethod& method : methods) {
    RotationResult& result = report.results.emplace_back();
    result.method = method.name;
    result.precision = method.precision;
    result.selectable = method.selectable;
    result.is_default = method.selectable && method.name == default_name;
    result.floor = 1e6 * static_cast<double>(method.bytes) / copy_bytes_per_second;
  }
  Progress progress("case", static_cast<int64_t>(fixtures::hard_cases().size()));
  int64_t done = 0;
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
    progress.show(++done, hard.name);
    for (const Precision precision : {Precision::single, Precision::twice}) {
      const fixtures::Problems problems = pose(hard, std::max(counts.matrices, hard.fewest), precision, counts.seed);
      double& error = precision == Precision::single ? report.reference_error_single : report.reference_error_double;
      error = std::max(error, problems.reference_error);
      for (std::size_t k = 0; k < methods.size(); ++k) {
        if (methods[k].precision != precision) continue;
        const auto solve = [&](const std::vector<Mat3>& a, const std::vector<Mat3>& previous) {
          return methods[k].solve(a, previous, 0).answers;
        };
        report.results[k].cases.push_back({hard.name, judge(problems, solve)});
      }
    }
  }
  for (const Precision precision : {Precision::single, Precision::twice}) {
    const fixtures::Frame near = fixtures::draw_ordinary(counts.timed, precision, kNearTurn, counts.seed);
    const fixtures::Frame cold = fixtures::draw_ordinary(counts.timed, precision, kColdStart, counts.seed);
    for (std::size_t k = 0; k < methods.size(); ++k) {
      if (methods[k].precision != precision) continue;
      progress.show(done, "times of " + methods[k].name);
      report.results[k].near = per_million(methods[k], near, counts.repeats);
      report.results[k].cold = per_million(methods[k], cold, counts.repeats);
    }
  }
  for (RotationResult& result : report.results) sum_up(result);
  mark_front(report.results);
  return report;
}

json to_json(const RotationReport& report) {
  json document = json::object();
  const auto bounds = [](Precision precision, double reference_error) -> json {
    const fixtures::RotationBounds bound = fixtures::rotation_bounds(precision);
    return {{"gap", bound.gap},
            {"orthogonality", bound.orthogonality},
            {"deviation", bound.deviation},
            {"reference_error", reference_error}};
  };
  document["bounds"] = {{"single", bounds(Precision::single, report.reference_error_single)},
                        {"double", bounds(Precision::twice, report.reference_error_double)}};
  document["cases"] = json::array();
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
    document["cases"].push_back(
        {{"name", hard.name}, {"what", hard.what}, {"expected", hard.behaviour}, {"seed", hard.seed}});
  }
  document["methods"] = json::array();
  document["rows"] = json::array();
  for (const RotationResult& r : report.results) {
    document["methods"].push_back({{"method", r.method},
                                   {"precision", name_of(r.precision)},
                                   {"selectable", r.selectable},
                                   {"default", r.is_default},
                                   {"on_front", r.on_front},
                                   {"answers", r.answers},
                                   {"wrong", r.wrong},
                                   {"not_finite", r.not_finite},
                                   {"flagged", r.flagged},
                                   {"worst_gap", json_number(r.worst_gap)},
                                   {"worst_case", r.worst_case},
                                   {"worst_orthogonality", json_number(r.worst_orthogonality)},
                                   {"worst_deviation", json_number(r.worst_deviation)},
                                   {"near_seconds_per_million", to_json(r.near)},
                                   {"cold_seconds_per_million", to_json(r.cold)},
                                   {"floor_seconds_per_million", r.floor},
                                   {"multiple_of_floor", r.near.median / r.floor}});
    for (const RotationCaseResult& entry : r.cases) {
      const fixtures::Judged& judged = entry.judged;
      json row = {{"method", r.method},
                  {"precision", name_of(r.precision)},
                  {"case", entry.name},
                  {"answers", judged.answers},
                  {"wrong", judged.wrong},
                  {"not_finite", judged.not_finite},
                  {"reflections", judged.reflections},
                  {"flagged", judged.flagged},
                  {"worst_gap", to_json(judged.worst_gap)},
                  {"median_gap", to_json(judged.median_gap)},
                  {"worst_orthogonality", json_number(judged.worst_orthogonality)},
                  {"worst_deviation", json_number(judged.worst_deviation)}};
      if (judged.wrong > 0) row["first_wrong"] = judged.first_wrong;
      document["rows"].push_back(std::move(row));
    }
  }
  document["holds"] = report.default_holds();
  return document;
}

namespace {

std::string milliseconds(double seconds) { return fmt::format("{:.4g}", 1e3 * seconds); }

// One line for each method.
void print_methods(const RotationReport& report) {
  Table table({"method", "precision", "worst gap", "in case", "‖RᵀR - I‖", "wrong", "NaN", "near ms", "least", "most",
               "cold ms", "× floor", ""});
  for (const RotationResult& r : report.results) {
    std::string marks = r.on_front ? "front" : "";
    if (r.is_default) marks += marks.empty() ? "default" : ", default";
    table.add({r.method, name_of(r.precision), fmt::format("{:.1e}", r.worst_gap), r.worst_case,
               fmt::format("{:.1e}", r.worst_orthogonality), fmt::format("{}", r.wrong),
               fmt::format("{}", r.not_finite), milliseconds(r.near.median), milliseconds(r.near.min),
               milliseconds(r.near.max), milliseconds(r.cold.median), fmt::format("{:.1f}", r.near.median / r.floor),
               marks});
  }
  fmt::print("\n{}", table.text());
}

// One line for each case: the worst gap, and how many are wrong, of each method.
void print_cases(const RotationReport& report, Precision precision) {
  std::vector<const RotationResult*> columns;
  std::vector<std::string> head = {name_of(precision) + ": worst gap (wrong)"};
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

struct RotationOptions {
  std::string backend = "reference";
  RotationCounts counts;
  std::optional<int64_t> timed;
  bool cases = false;  // a table of every case, too
  std::string json;
};

int bench_rotations(const RotationOptions& options) {
  require_timed_backend(options.backend);
  require_writable(options.json);
  RotationCounts counts = options.counts;
  counts.timed = options.timed.value_or(options.backend == "gpu" ? 1'000'000 : 20'000);

  json document = begin_report("rotations", options.backend);
  const MachineLimits machine = measure_machine(options.backend);
  fmt::print("{} matrices of each case, {} timed {} times, seed {}; copy, read + written: {:.4g} GB/s\n",
             counts.matrices, counts.timed, counts.repeats, counts.seed, 1e-9 * machine.copy_bytes_per_second);
  const RotationReport report = measure_rotations(rotation_methods(options.backend), counts,
                                                  rotation_of(BackendChoice{}), machine.copy_bytes_per_second);
  if (options.cases) {
    for (const Precision precision : {Precision::single, Precision::twice}) print_cases(report, precision);
  }
  print_methods(report);
  const fixtures::RotationBounds single = fixtures::rotation_bounds(Precision::single),
                                 twice = fixtures::rotation_bounds(Precision::twice);
  fmt::print(
      "\nTimes are of a million matrices, near the answer ({} rad) and from the identity. An answer is wrong beyond a\n"
      "gap of {:.1e} or ‖RᵀR - I‖ = {:.1e} (double: {:.1e}, {:.1e}), or where the case expects another. The best "
      "values\n"
      "that answers are compared with are certain to {:.1e} (double: {:.1e}).\n",
      kNearTurn, single.gap, single.orthogonality, twice.gap, twice.orthogonality, report.reference_error_single,
      report.reference_error_double);
  for (const RotationResult& r : report.results) {
    if (!r.is_default) continue;
    fmt::print("The default, {} in {} precision, is wrong in {} of {} answers.\n", r.method, name_of(r.precision),
               r.wrong, r.answers);
    for (const RotationCaseResult& entry : r.cases) {
      if (entry.judged.wrong > 0) fmt::print("  FAILS: {}: {}\n", entry.name, entry.judged.first_wrong);
    }
  }
  document["matrices"] = counts.matrices;
  document["timed"] = counts.timed;
  document["repeats"] = counts.repeats;
  document["seed"] = counts.seed;
  document["machine_limits"] = {{"copy_bytes_per_second", machine.copy_bytes_per_second}};
  document.update(to_json(report));
  document["complete"] = true;
  write_report(options.json, document);
  if (!options.json.empty()) fmt::print("\nwrote {}\n", options.json);
  return report.default_holds() ? 0 : 1;
}

}  // namespace

Suite rotations_suite() {
  return {"rotations", "methods for the rotation of a cluster, on every hard case", [](CLI::App& command) {
            const auto options = std::make_shared<RotationOptions>();
            command.add_option("--backend", options->backend, "where: reference, host or gpu")
                ->capture_default_str()
                ->type_name("B");
            command.add_option("--matrices", options->counts.matrices, "of each case")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::Range(1, 10'000'000));
            command
                .add_option("--timed", options->timed,
                            "matrices that are timed together (default: 20000; gpu: 1000000)")
                ->type_name("N")
                ->check(CLI::Range(1, 100'000'000));
            command.add_option("--repeats", options->counts.repeats, "of each timing, after one that does not count")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::Range(1, 10'000));
            command.add_option("--seed", options->counts.seed, "added to the seeds of the cases")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::NonNegativeNumber);
            command.add_flag("--cases", options->cases, "print the worst gap in every case as well");
            command.add_option("--json", options->json, "write errors, times and floors")->type_name("F");
            return [options] { return bench_rotations(*options); };
          }};
}

}  // namespace cutproof::cli
