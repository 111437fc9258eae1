#include <fmt/ranges.h>

#include "model/io/columns.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

RowColumns columns_of_baselines() {
  return {{"method", "{name}"},
          {"source", "{source}", Shown::page},
          {"frame [ms]", "{1e3*seconds/median:.3g}"},
          {"isolated", "{isolated}"},
          {"components", "{components}"},
          {"couplings", "{couplings}"},
          {"shells", "{shells}"},
          {"unequal frames", "{unequal_frames} of {frames}"},
          {"removed", "{removed}", Shown::page},
          {"lost/area [h]", "{geometry/lost_per_area:.3g}", Shown::terminal},
          {"ideal [h]", "{geometry/least_per_area:.3g}", Shown::terminal},
          {"Hausdorff [h]", "{geometry/hausdorff:.3g}"},
          {"lost volume [h³]", "{geometry/lost_volume:.3g}", Shown::page},
          {"interpenetration [h³]", "{interpenetration/volume:.3g} ± {interpenetration/bound:.2g}"},
          {"clusters", "{clusters_before} -> {clusters}", Shown::terminal}};
}

RowColumns columns_of_methods() {
  return {{"method", "{name}"},
          {"settings", "{settings}", Shown::page},
          {"particles", "{particles}"},
          {"s/s", "{seconds_per_second:.3g}"},
          {"frame [ms]", "{1e3*frame/median:.3g}"},
          {"cutting [ms]", "{1e3*cutting/median:.3g}", Shown::page},
          {"error", "{error/rms:.2g}"},
          {"pieces", "{pieces/at_least}..{pieces/at_most}"},
          {"coupled", "{pieces/coupled}"},
          {"felt, blade in", "{felt/blade_in:.2g}", Shown::page},
          {"felt", "{felt/withdrawn:.2g}"},
          {"lost", "{lost:.2g}"},
          {"spin", "{spin_kept:.3g}"},
          {"fragments", "{fragments}", Shown::page},
          {"fails", [](const Field& row) {
             return row["refused"].is_nothing() ? fmt::format("{}", fmt::join(row["fails"].texts(), ", "))
                                                : std::string("refused");
           }}};
}

void add_methods(Sheet& sheet, const Field& document) {
  Chart chart = {"Speed against error, on the way to rest",
                 "Each point is a run. The error is the RMS distance from a converged solution, as a share of its "
                 "displacement: lower is nearer; left is faster.",
                 {"computing time of a simulated second", "s", true},
                 {"error", "1", true},
                 {}};
  const RowColumns columns = columns_of_methods();
  Grid grid = grid_of("Table 3: other simulators",
                      "All cut the same kidney of one material and are judged as runs. “coupled” are components of the "
                      "coupling; “felt” is the share of a kick of the largest free piece that what is held feels.",
                      columns);
  document["methods"].each([&](const Field& row) {
    const bool is_refused = !row["refused"].is_nothing();
    if (!is_refused && !row["error"].is_nothing()) {
      curve_named(chart, row["name"].text(), Look::dots)
          .dots.push_back(
              {row["seconds_per_second"].number_or_null(), row["error"]["rms"].number_or_null(),
               fmt::format("{} particles, {}", io::grouped(row["particles"].count()), row["settings"].text())});
    }
    add_row(grid, columns, row, is_refused || row["fails"].length() > 0 ? "warn" : "");
  });
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
}

void add_baselines(Sheet& sheet, const Field& document) {
  Chart chart = {"Speed against the error of the cut",
                 "Each point is a method. The distance is the Hausdorff distance: the lower, the nearer the skin of "
                 "the cut lies to the ideal cut; left is faster.",
                 {"median time of a frame", "ms", true},
                 {"distance from the ideal cut", "h", false},
                 {}};
  const RowColumns columns = columns_of_baselines();
  Grid grid = grid_of("Methods",
                      "Components of the tissue, of the coupling, and shells of the skin must be equal in every frame; "
                      "“isolated” counts groups of clusters that are coupled to nothing inside connected tissue.",
                      columns);
  document["rows"].each([&](const Field& row) {
    const Field geometry = row["geometry"], settings = row["settings"];
    const bool is_right = row["unequal_frames"].count() == 0 && row["isolated"].count() == 0;
    curve_named(chart, is_right ? "components always equal, none isolated" : "unequal or isolated in some frame",
                Look::dots)
        .dots.push_back({in_ms(row["seconds"]),
                         geometry.is_nothing() ? std::nullopt : geometry["hausdorff"].number_or_null(),
                         fmt::format("{} ({}): expand {}, merge {}, detect {}, deletion {}", row["name"].text(),
                                     row["source"].text(), settings["expand"].text(), settings["merge"].text(),
                                     settings["detect"].text(), settings["deletion"].text())});
    add_row(grid, columns, row, is_right ? "" : "warn");
  });
  sheet.summary = fmt::format("This method beside others, on the same kidney of {} particles.",
                              io::grouped(document["particles"].count()));
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
  if (document["methods"].is_there()) add_methods(sheet, document);
}

}  // namespace

const Suite kBaselinesSuite = {"baselines", "rows", columns_of_baselines, add_baselines};
const Suite kMethodsOfBaselines = {"baselines", "methods", columns_of_methods, add_methods};

}  // namespace cutproof::report
