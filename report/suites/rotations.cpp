#include <map>

#include "model/io/columns.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

RowColumns columns_of_rotations() {
  return {{"method", "{method}"},
          {"precision", "{precision}"},
          {"worst gap", "{worst_gap:.1e}"},
          {"in the case", "{worst_case}"},
          {"‖RᵀR - I‖", "{worst_orthogonality:.1e}"},
          {"answers", "{answers}", Shown::page},
          {"wrong", "{wrong}"},
          {"NaN", "{not_finite}", Shown::terminal},
          {"near [ms]", "{1e3*near_seconds_per_million/median:.4g}"},
          {"least [ms]", "{1e3*near_seconds_per_million/min:.4g}", Shown::terminal},
          {"most [ms]", "{1e3*near_seconds_per_million/max:.4g}", Shown::terminal},
          {"cold [ms]", "{1e3*cold_seconds_per_million/median:.4g}", Shown::terminal},
          {"× limit", "{multiple_of_limit:.1f}"},
          {"on the front", "{on_front}"},
          {"default", "{default}"}};
}

void add_rotations(Sheet& sheet, const Field& document) {
  std::map<std::string, Chart> charts;
  std::map<std::string, std::vector<Dot>> fronts;
  const RowColumns columns = columns_of_rotations();
  Grid grid = grid_of("Methods",
                      "Worst over all hard cases. A gap says by how much the answer is worse than the best rotation, "
                      "relative to it. Times are of a million matrices near the answer. “On the front”: no other "
                      "method of this precision is both as fast and as near.",
                      columns, 1);
  document["methods"].each([&](const Field& method) {
    const std::string precision = method["precision"].text();
    if (precision != "single" && precision != "double")
      method["precision"].refuse("'" + precision + "' is no precision");
    const int64_t wrong = method["wrong"].count();
    const bool is_default = method["default"].flag(), on_front = method["on_front"].flag();
    const std::string text = fmt::format("{}{}, {} precision; worst case {}, {} of {} answers wrong",
                                         method["method"].text(), is_default ? " (the default)" : "", precision,
                                         method["worst_case"].is_nothing() ? "–" : method["worst_case"].text(),
                                         io::grouped(wrong), io::grouped(method["answers"].count()));
    Chart& chart = charts
                       .try_emplace(precision, Chart{"Speed against error, " + precision + " precision",
                                                     "Left is faster, below is nearer to the best rotation. The thin "
                                                     "line joins the methods that no other beats in both.",
                                                     {"median time of a million matrices", "ms", true},
                                                     {"worst gap to the best rotation", "1", true},
                                                     {}})
                       .first->second;
    const Dot dot = {in_ms(method["near_seconds_per_million"]), method["worst_gap"].number_or_null(), text};
    curve_named(chart,
                wrong > 0    ? "some answers wrong"
                : is_default ? "the default"
                             : "all answers right",
                Look::dots)
        .dots.push_back(dot);
    if (on_front) fronts[precision].push_back(dot);
    add_row(grid, columns, method, wrong > 0 ? "warn" : on_front ? "good" : "");
  });
  const RowColumns of_case = {{"case", "{case}"},           {"method", "{method}"},
                              {"precision", "{precision}"}, {"worst gap", "{worst_gap:.1e}"},
                              {"wrong", "{wrong}"},         {"reflections", "{reflections}"},
                              {"flagged", "{flagged}"}};
  Grid cases = grid_of("Every method in every case",
                       "The hard cases are described in the documentation (method, Hard cases).", of_case, 1);
  document["rows"].each(
      [&](const Field& row) { add_row(cases, of_case, row, row["wrong"].count() > 0 ? "warn" : ""); });
  for (const char* const precision : {"single", "double"}) {
    const auto found = charts.find(precision);
    if (found == charts.end()) continue;
    found->second.curves.push_back(front_of(fronts[precision], "the best"));
    sheet.pieces.emplace_back(std::move(found->second));
  }
  sheet.summary = "Every way of finding the best rotation, on hard cases, and its time.";
  sheet.pieces.emplace_back(std::move(grid));
  sheet.pieces.emplace_back(std::move(cases));
}

}  // namespace

const Suite kRotationsSuite = {"rotations", "methods", columns_of_rotations, add_rotations};

}  // namespace cutproof::report
