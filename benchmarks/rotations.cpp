#include "benchmarks/rotations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "benchmarks/contenders.h"
#include "model/io/json_number.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

constexpr double kColdStart = -1;

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
                                 const std::string& default_name, double copy_bytes_per_second,
                                 const RotationProgress& progress) {
  const auto show = [&](int64_t begun, const std::string& what) {
    if (progress) progress(begun, what);
  };
  RotationReport report;
  for (const RotationMethod& method : methods) {
    RotationResult& result = report.results.emplace_back();
    result.method = method.name;
    result.precision = method.precision;
    result.selectable = method.selectable;
    result.is_default = method.selectable && method.name == default_name;
    result.limit = 1e6 * static_cast<double>(method.bytes) / copy_bytes_per_second;
  }
  int64_t done = 0;
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
    show(++done, hard.name);
    for (const Precision precision : {Precision::binary32, Precision::binary64}) {
      const fixtures::Problems problems = pose(hard, std::max(counts.matrices, hard.fewest), precision, counts.seed);
      double& error = precision == Precision::binary32 ? report.reference_error_single : report.reference_error_double;
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
  for (const Precision precision : {Precision::binary32, Precision::binary64}) {
    const fixtures::Frame near = fixtures::draw_ordinary(counts.timed, precision, kNearTurn, counts.seed);
    const fixtures::Frame cold = fixtures::draw_ordinary(counts.timed, precision, kColdStart, counts.seed);
    for (std::size_t k = 0; k < methods.size(); ++k) {
      if (methods[k].precision != precision) continue;
      show(done, "times of " + methods[k].name);
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
  document["bounds"] = {{"single", bounds(Precision::binary32, report.reference_error_single)},
                        {"double", bounds(Precision::binary64, report.reference_error_double)}};
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
                                   {"limit_seconds_per_million", r.limit},
                                   {"multiple_of_limit", r.near.median / r.limit}});
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

}  // namespace cutproof::benchmarks
