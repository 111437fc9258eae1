#include <algorithm>
#include <cmath>
#include <map>

#include "model/io/columns.h"
#include "model/io/filled.h"
#include "model/io/verdict_json.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

// A figure relative to what is there has no unit.
std::string unit_in_words(const Field& row) {
  const std::string unit = row["unit"].text();
  return unit == "1" ? "relative" : unit;
}

std::string measured_in_unit(const Field& row) {
  const std::string measured = io::filled("{measured:.2g}", row.there());
  const Field unit = row["measured_unit"];
  return unit.is_nothing() ? measured : io::in_unit(measured, unit.text());
}

// Sizes of one unit share a plot: a length and a weight have no common axis.
Chart chart_of(const std::string& unit) {
  return {"Least size that is rejected, in " + (unit == "1" ? "relative terms" : unit),
          "Each point is a disturbance. The nearer to the diagonal line, ten times what rounding does, the sharper the "
          "judge.",
          {"what rounding does", unit, true},
          {"least size that is rejected", unit, true},
          {}};
}

void add_goal(Chart& chart) {
  double low = INFINITY, high = 0;
  for (const Curve& curve : chart.curves) {
    for (const Dot& dot : curve.dots) {
      low = std::min(low, *dot.x);
      high = std::max(high, *dot.x);
    }
  }
  chart.curves.push_back({"ten times rounding",
                          Look::level,
                          {{low, 10 * low, "ten times rounding"}, {high, 10 * high, "ten times rounding"}}});
}

RowColumns columns_of_sensitivity() {
  return {{"disturbance", "{disturbance}"},
          {"after", "{stage}"},
          {"scene", "{scene}"},
          {"unit", unit_in_words},
          {"least rejected", "{least:.2g}"},
          {"by", "{property}"},
          {"its measured", measured_in_unit, Shown::terminal},
          {"of bound", "{of_bound:.2g}", Shown::terminal},
          {"rounding", "{rounding:.2g}"},
          {"ratio", "{ratio:.2g}"},
          {"goal", "{goal:.2g}"},
          {"within the goal", "{within_goal}"}};
}

void add_sensitivity(Sheet& sheet, const Field& document) {
  std::map<std::string, Chart> charts;
  std::vector<std::string> units;
  const RowColumns columns = columns_of_sensitivity();
  Grid grid = grid_of("Every disturbance",
                      "The least size of a disturbance that some property rejects, beside what rounding does to the "
                      "same figure. The goal is ten times rounding.",
                      columns, 1);
  int64_t within = 0, judged = 0;
  document["rows"].each([&](const Field& row) {
    const std::string unit = row["unit"].text(), stage(name_of(row["stage"].stage()));
    const std::optional<double> least = row["least"].number_or_null(), rounding = row["rounding"].number_or_null();
    const Field goal = row["within_goal"];
    const bool is_missed = !goal.is_nothing() && !goal.flag();
    judged += !goal.is_nothing();
    within += !goal.is_nothing() && !is_missed;
    if (rounding && *rounding > 0 && least) {
      if (!charts.contains(unit)) units.push_back(unit);
      curve_named(charts.try_emplace(unit, chart_of(unit)).first->second, stage, Look::dots)
          .dots.push_back(
              {rounding, least,
               fmt::format("{} after {} in {}: rejected by {}", row["disturbance"].text(), stage, row["scene"].text(),
                           row["property"].is_nothing() ? "nothing" : row["property"].text())});
    }
    add_row(grid, columns, row, !least ? "bad" : is_missed ? "warn" : "");
  });
  for (const std::string& unit : units) {
    add_goal(charts.at(unit));
    sheet.pieces.emplace_back(std::move(charts.at(unit)));
  }
  sheet.summary =
      fmt::format("How small a fault the judge still rejects: {} of {} disturbances that have a goal are within it.",
                  io::grouped(within), io::grouped(judged));
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kSensitivitySuite = {"sensitivity", "rows", columns_of_sensitivity, add_sensitivity};

}  // namespace cutproof::report
