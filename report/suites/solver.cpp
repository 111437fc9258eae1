#include "model/io/columns.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

RowColumns columns_of_solver() {
  return {{"acceleration", "{acceleration}"}, {"iterations", "{iterations}"},
          {"max [h]", "{max_h:.2g}"},         {"RMS [h]", "{rms_h:.2g}"},
          {"energy gap", "{energy_gap:.1e}"}, {"median [ms]", "{1e3*seconds/median:.4f}"}};
}

void add_solver(Sheet& sheet, const Field& document) {
  const double tolerance = document["tolerance_h"].number();
  std::string name;
  RowColumns columns = columns_of_solver();
  columns.insert(columns.begin(), {"scene", [&](const Field&) { return name; }});
  Grid grid = grid_of("Every row",
                      "Errors are distances from the reference solution, in particle spacings h. Times are of a step.",
                      columns, 0);
  document["scenes"].each([&](const Field& scene) {
    name = fmt::format("{}, k = {:.3g} s⁻², {} {}", scene["scene"].text(), scene["stiffness"].number(),
                       scene["substeps"].count(), scene["substeps"].count() == 1 ? "substep" : "substeps");
    Chart chart = {
        "Speed against error: " + name,
        fmt::format("{} particles in {} clusters. Each point is a number of iterations; left is faster, below "
                    "is nearer to the reference solution.",
                    io::grouped(scene["particles"].count()), io::grouped(scene["clusters"].count())),
        {"median time of a step", "ms", true},
        {"greatest distance", "h", true},
        {}};
    std::vector<Dot> all;
    scene["rows"].each([&](const Field& row) {
      const std::string acceleration = row["acceleration"].text();
      const Dot dot = {in_ms(row["seconds"]), row["max_h"].number_or_null(),
                       fmt::format("{} iterations, acceleration {}", row["iterations"].count(), acceleration)};
      curve_named(chart, "acceleration " + acceleration, Look::joined).dots.push_back(dot);
      all.push_back(dot);
      add_row(grid, columns, row);
    });
    chart.curves.push_back(front_of(all, "the best"));
    add_tolerance(chart, all, tolerance);
    if (!scene["converged"].flag())
      sheet.notes.push_back(name + ": the reference solution did not converge, so these errors are not known.");
    sheet.pieces.emplace_back(std::move(chart));
  });
  sheet.summary = "What iterations of the solver cost, and how near they come to the reference solution.";
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kSolverSuite = {"solver", "scenes", columns_of_solver, add_solver};

}  // namespace cutproof::report
