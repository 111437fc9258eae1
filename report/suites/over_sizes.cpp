#include "report/suites/over_sizes.h"

#include <algorithm>

namespace cutproof::report {

Variants::Variants(const Field& rows) {
  rows.each([&](const Field& row) {
    for (std::size_t k = 0; k < std::size(kNames); ++k) seen_[k].insert(row[kNames[k]].text_or(""));
  });
}

std::string Variants::of(const Field& row) const {
  std::string text;
  for (std::size_t k = 0; k < std::size(kNames); ++k) {
    const std::string value = row[kNames[k]].text_or("");
    if (seen_[k].size() < 2 || value.empty()) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kNames[k], value);
  }
  return text;
}

std::string Variants::scene_of(const Field& row) const { return with(row["scene"].text(), of(row)); }

RowColumns Variants::named(RowColumns columns) const {
  columns.insert(columns.begin(), {"scene", [this](const Field& row) { return scene_of(row); }, Shown::page});
  return columns;
}

std::string with(const std::string& name, const std::string& variant) {
  return variant.empty() ? name : name + ", " + variant;
}

std::string solver_text(const Field& row) {
  return fmt::format("{} substeps × {} iterations, acceleration {}", row["substeps"].count(), row["iterations"].count(),
                     row["acceleration"].text());
}

Stack stage_stack() {
  Stack stack = {"Time of each stage",
                 "Medians of spans of one stage, one above the other. A frame runs them as one piece, so it may take "
                 "less than their sum; its own time is in the table. A stage that did not run has no part.",
                 "ms",
                 {},
                 {}};
  for (const Stage stage : kStages) stack.parts.push_back({std::string(name_of(stage)), {}});
  return stack;
}

void show_stack(Sheet& sheet, Stack&& stack) {
  std::erase_if(stack.parts, [](const Series& part) {
    return std::none_of(part.values.begin(), part.values.end(), [](const auto& value) { return value && *value > 0; });
  });
  if (!stack.labels.empty()) sheet.pieces.emplace_back(std::move(stack));
}

Chart over_particles(const std::string& title, const std::string& words) {
  return {title, words, {"particles", "", true}, {"median time", "ms", true}, {}};
}

void sort_by_x(Chart& chart) {
  for (Curve& curve : chart.curves) {
    std::stable_sort(curve.dots.begin(), curve.dots.end(), [](const Dot& a, const Dot& b) { return a.x < b.x; });
  }
}

RowColumns scene_columns(const RowColumns& beside_times) {
  RowColumns columns = {{"scene", "{scene}", Shown::terminal},
                        {"iterations", "{substeps} × {iterations}", Shown::terminal},
                        {"acceleration", "{acceleration}", Shown::terminal},
                        {"particles", "{particles}"},
                        {"clusters", "{clusters}"}};
  for (const std::string_view stage : kStageNames)
    columns.emplace_back(fmt::format("{} [ms]", stage), fmt::format("{{1e3*seconds/{}/median:.4g}}", stage));
  columns.emplace_back("frame [ms]", "{1e3*seconds/frame/median:.4g}");
  columns.emplace_back("least [ms]", "{1e3*seconds/frame/min:.4g}");
  columns.emplace_back("most [ms]", "{1e3*seconds/frame/max:.4g}");
  columns.insert(columns.end(), beside_times.begin(), beside_times.end());
  columns.emplace_back("error of step [h]", "{error/step/max_h:.4g}", Shown::page);
  columns.emplace_back("topology holds", "{error/frame/topology_holds}", Shown::page);
  return columns;
}

TimedScenes::TimedScenes(const Field& document, const RowColumns& columns)
    : variants(document["rows"]),
      columns_(variants.named(columns)),
      grid_(grid_of("Every time, beside its error",
                    "Times are medians. The error is the greatest distance of a position after one step from the "
                    "reference's, in particle spacings h.",
                    columns_)) {}

void TimedScenes::add(const Field& row) {
  const Field seconds = row["seconds"], frame = row["error"]["frame"];
  stack_.labels.push_back(variants.scene_of(row));
  for (Series& part : stack_.parts) part.values.push_back(in_ms(seconds[part.name.c_str()]));
  const bool holds = frame.is_nothing() || frame["topology_holds"].flag();
  holds_ = holds_ && holds;
  add_row(grid_, columns_, row, holds ? "" : "bad");
}

void TimedScenes::show_stack(Sheet& sheet) { report::show_stack(sheet, std::move(stack_)); }

void TimedScenes::show_tables(Sheet& sheet, const Field& document, bool is_asked) {
  if (!holds_) sheet.holds = false;
  add_table_3(sheet, document, is_asked);
  sheet.pieces.emplace_back(std::move(grid_));
}

}  // namespace cutproof::report
