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
  fixtures::Judged& all = result.all;
  for (const RotationCaseResult& entry : result.cases) {
    const fixtures::Judged& judged = entry.judged;
    all.answers += judged.answers;
    all.wrong += judged.wrong;
    all.not_finite += judged.not_finite;
    all.flagged += judged.flagged;
    all.worst_orthogonality = std::max(all.worst_orthogonality, judged.worst_orthogonality);
    all.worst_deviation = std::max(all.worst_deviation, judged.worst_deviation);
    if (judged.worst_gap > all.worst_gap) {  // an absent one is less than any
      all.worst_gap = judged.worst_gap;
      result.worst_case = entry.name;
    }
  }
}

// The fields common to a method's sums and to each of its cases.
json row_of(const RotationResult& result, const fixtures::Judged& judged) {
  return {{"method", result.method},
          {"precision", name_of(result.precision)},
          {"answers", judged.answers},
          {"wrong", judged.wrong},
          {"not_finite", judged.not_finite},
          {"flagged", judged.flagged},
          {"worst_gap", json_number(judged.worst_gap)},
          {"worst_orthogonality", json_number(judged.worst_orthogonality)},
          {"worst_deviation", json_number(judged.worst_deviation)}};
}

}  // namespace

bool RotationReport::default_holds() const {
  return std::any_of(results.begin(), results.end(), [](const auto& r) { return r.is_default; }) &&
         std::all_of(results.begin(), results.end(), [](const auto& r) { return !r.is_default || r.all.wrong == 0; });
}

void mark_front(std::vector<RotationResult>& results) {
  // A method with answers that are not finite has no worst gap.
  const auto gap = [](const RotationResult& r) {
    return r.all.not_finite > 0 ? std::numeric_limits<double>::infinity() : r.all.worst_gap.value_or(0);
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
                                 double copy_bytes_per_second, const RotationProgress& progress) {
  const auto show = [&](int64_t begun, const std::string& what) {
    if (progress) progress(begun, what);
  };
  RotationReport report;
  for (const RotationMethod& method : methods) {
    RotationResult& result = report.results.emplace_back();
    result.method = method.name;
    result.precision = method.precision;
    result.is_default = method.is_default;
    result.limit = 1e6 * static_cast<double>(method.bytes) / copy_bytes_per_second;
  }
  int64_t done = 0;
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
    ++done;
    for (const Precision precision : {Precision::binary32, Precision::binary64}) {
      const fixtures::Problems problems = pose(hard, std::max(counts.matrices, hard.fewest), precision, counts.seed);
      double& error = precision == Precision::binary32 ? report.reference_error_single : report.reference_error_double;
      error = std::max(error, problems.reference_error);
      for (std::size_t k = 0; k < methods.size(); ++k) {
        if (methods[k].precision != precision) continue;
        show(done, hard.name);
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
    json method = row_of(r, r.all);
    method.update({{"default", r.is_default},
                   {"on_front", r.on_front},
                   {"worst_gap", json_number(r.all.worst_gap.value_or(0))},
                   {"worst_case", r.worst_case},
                   {"near_seconds_per_million", to_json(r.near)},
                   {"cold_seconds_per_million", to_json(r.cold)},
                   {"limit_seconds_per_million", r.limit},
                   {"multiple_of_limit", r.near.median / r.limit}});
    document["methods"].push_back(std::move(method));
    for (const auto& [name, judged] : r.cases) {
      json row = row_of(r, judged);
      row.update({{"case", name}, {"reflections", judged.reflections}, {"median_gap", json_number(judged.median_gap)}});
      if (judged.wrong > 0) row["first_wrong"] = judged.first_wrong;
      document["rows"].push_back(std::move(row));
    }
  }
  document["holds"] = report.default_holds();
  return document;
}

}  // namespace cutproof::benchmarks
