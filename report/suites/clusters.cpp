#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

std::string merging_of(const Field& row) {
  const Field tau = row["tau"];
  return tau.is_nothing() ? "no merging" : fmt::format("τ = {:.4g}", tau.number());
}

RowColumns columns_of_clusters() {
  return {{"merging", merging_of},
          {"growth at the end [%]", "{100*growth:+.1f}"},
          {"greatest growth [%]", "{100*greatest_growth:+.1f}"},
          {"as wanted", "{within_wanted}", Shown::page},
          {"particles", "{particles}", Shown::page},
          {"particles removed", "{removed}"},
          {"frame, median [ms]", "{1e3*seconds/median:.4g}"},
          {"verdicts", "{error/verdicts}"},
          {"failed", [](const Field& row) { return std::to_string(row["error"]["failed"].length()); }}};
}

void add_clusters(Sheet& sheet, const Field& document) {
  Chart chart = {"Clusters during a cut",
                 "How many clusters there are after each frame, for each threshold τ of merging.",
                 {"frame of the scene", "", false},
                 {"clusters", "", false},
                 {}};
  const RowColumns columns = columns_of_clusters();
  Grid grid =
      grid_of("Growth for each τ",
              fmt::format("Growth from the first frame to the last. The paper's is {:.3g} %; {:.3g} % are wanted.",
                          100 * document["paper"]["growth"].number(), 100 * document["wanted_growth"].number()),
              columns);
  document["rows"].each([&](const Field& row) {
    const Field frames = row["scene_frame"], counts = row["clusters"];
    const std::string name = merging_of(row);
    if (frames.length() != counts.length()) counts.refuse("this has not as many entries as 'scene_frame'");
    Curve curve = {name, Look::joined, {}};
    for (std::size_t k = 0; k < frames.length(); ++k)
      curve.dots.push_back(
          {static_cast<double>(frames.at(k).count()), static_cast<double>(counts.at(k).count()), name});
    chart.curves.push_back(std::move(curve));
    const bool fails = row["error"]["failed"].length() > 0;
    if (fails) sheet.holds = false;
    add_row(grid, columns, row, fails ? "bad" : "");
  });
  sheet.summary = "How the number of clusters grows while a kidney is cut through.";
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kClustersSuite = {"clusters", "rows", columns_of_clusters, add_clusters};

}  // namespace cutproof::report
