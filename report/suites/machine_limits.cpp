#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

RowColumns columns_of_machine_limits() {
  return {{"what", "{what}"},
          {"median [ms]", "{1e3*seconds/median:.4g}"},
          {"least [ms]", "{1e3*seconds/min:.4g}"},
          {"most [ms]", "{1e3*seconds/max:.4g}"},
          {"GB/s",
           [](const Field& row) {  // of copies only
             const std::optional<double> speed = row["bytes_per_second"].number_or_null();
             return speed ? figure_text(speed, 1e-9) : "";
           }},
          {"lost", "{lost}"}};
}

void add_machine_limits(Sheet& sheet, const Field& document) {
  const RowColumns columns = columns_of_machine_limits();
  Grid grid = grid_of("What this machine can do at best", "Times of other benchmarks are given as multiples of these.",
                      columns);
  document["rows"].each([&](const Field& row) {
    const bool has_lost = row["lost"].number_or_null().value_or(0) > 0;
    if (has_lost) sheet.holds = false;
    add_row(grid, columns, row, has_lost ? "bad" : "");
  });
  sheet.summary = "The limits of the machine: copies and launches.";
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kMachineLimitsSuite = {"machine_limits", "rows", columns_of_machine_limits, add_machine_limits};

}  // namespace cutproof::report
