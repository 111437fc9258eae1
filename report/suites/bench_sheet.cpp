// Benchmarks: the page of each suite->
#include "report/suites/suites.h"

namespace cutproof::report {

std::optional<double> times(const std::optional<double>& value, double factor) {
  return value ? std::optional(factor * *value) : std::nullopt;
}

std::optional<double> in_ms(const Field& field) { return times(seconds_of(field), 1e3); }

Curve& curve_named(Chart& chart, const std::string& name, Look look) {
  for (Curve& curve : chart.curves) {
    if (curve.name == name) return curve;
  }
  return chart.curves.emplace_back(Curve{name, look, {}});
}

Sheet bench_sheet(const Field& document) {
  const Field named = document["suite"];
  const std::string name = named.text();
  for (const Suite* const suite : kSuites) {
    if (name != suite->name) continue;
    Sheet sheet;
    sheet.kind = "benchmark";
    sheet.title = name;
    add_measurement(sheet, document);
    if (document[suite->rows].length() == 0) sheet.holds = false;
    suite->add(sheet, document);
    if (document[suite->rows].length() == 0) {
      sheet.summary = "Nothing was measured.";
      sheet.pieces.clear();
    }
    // What is worse than the document says is said as it is.
    if (sheet.holds && !*sheet.holds && sheet.badge != "incomplete") sheet.badge = "fails";
    return sheet;
  }
  std::string known;
  for (const Suite* const suite : kSuites) known += (known.empty() ? "" : ", ") + std::string(suite->name);
  named.refuse("'" + name + "' is no suite that a page is made of; these are: " + known + ", tune");
}

}  // namespace cutproof::report
