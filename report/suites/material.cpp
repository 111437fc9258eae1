#include "model/io/columns.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

std::string ratio_of(const Field& row) {
  const double asked = row["asked"].number();
  const std::optional<double> measured = row["measured"].number_or_null();
  return asked == 0 || !measured ? std::string() : fmt::format("{:.3f}", *measured / asked);
}

RowColumns columns_of_material() {
  return {{"along", "{along}"},     {"clusters", "{cooking}", Shown::page},
          {"side", "{side}"},       {"ν", "{poisson_ratio:.2f}"},
          {"across", "{across}"},   {"K", "{iterations}"},
          {"test", "{test}"},       {"of", "{quantity}"},
          {"asked", "{asked:.4g}"}, {"measured", "{measured:.4g}"},
          {"ratio", ratio_of}};
}

void add_material(Sheet& sheet, const Field& document) {
  Chart chart = {"Measured over asked, by thickness",
                 "Each point is a bar along 100. Right is 1. Few clusters across make a bar too stiff.",
                 {"nodes across", "", true},
                 {"measured over asked", "", true},
                 {}};
  const RowColumns columns = columns_of_material();
  Grid grid = grid_of("Every row", "Bars of 10 kPa, five times as long as they are thick.", columns, 6);
  document["rows"].each([&](const Field& row) {
    add_row(grid, columns, row);
    const std::optional<double> measured = row["measured"].number_or_null();
    if (row["along"].text() != "100" || !row["iterations"].is_nothing() || !measured || row["asked"].number() == 0)
      return;
    const std::string name = fmt::format("{}: {}, {} of side {}, ν = {}", row["test"].text(), row["quantity"].text(),
                                         row["cooking"].text(), row["side"].count(), row["poisson_ratio"].number());
    curve_named(chart, name, Look::joined)
        .dots.push_back({double(row["across"].count()), *measured / row["asked"].number(), name});
  });
  sheet.summary = "Moduli of bars, beside those of their material.";
  if (!chart.curves.empty()) sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kMaterialSuite = {"material", "rows", columns_of_material, add_material};

}  // namespace cutproof::report
