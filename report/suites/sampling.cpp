#include "model/io/columns.h"
#include "report/suites/over_sizes.h"

namespace cutproof::report {

namespace {

RowColumns paper_columns(Shown shown) {
  return {{"to first", "{frame_to_first:.4g}", shown},
          {"paper: particles", "{paper/particles}", shown},
          {"paper: clusters", "{paper/clusters}", shown},
          {"paper: frame [ms]", "{1e3*paper/frame_seconds:.4g}", shown},
          {"paper: to first", "{paper/frame_to_first:.4g}", shown}};
}

RowColumns columns_of_sampling() { return scene_columns(paper_columns(Shown::terminal)); }

void add_sampling(Sheet& sheet, const Field& document) {
  TimedScenes scenes(document, columns_of_sampling());
  const int64_t scaled_down = document["scaled_down"].count();
  Chart chart = over_particles("Time over size",
                               "A whole frame by number of particles, ours and the paper's, both axes logarithmic.");
  RowColumns columns = {
      {"particles", "{particles}"}, {"clusters", "{clusters}"}, {"frame [ms]", "{1e3*seconds/frame/median:.4g}"}};
  for (RowColumn& column : paper_columns(Shown::page)) columns.push_back(std::move(column));
  Grid table = grid_of(
      "Table 2 of the paper, beside ours",
      fmt::format("The discontinuous cut of a kidney at four samplings{}. “To first”: the frame's time over that of "
                  "the first row.",
                  scaled_down == 1
                      ? ""
                      : fmt::format(", of 1/{} of the paper's particles: --full takes them all", scaled_down)),
      columns);
  document["rows"].each([&](const Field& row) {
    scenes.add(row);
    const std::string variant = scenes.variants.of(row);
    curve_named(chart, with("frame, ours", variant), Look::joined)
        .dots.push_back({static_cast<double>(row["particles"].count()), in_ms(row["seconds"]["frame"]),
                         fmt::format("frame of {}: {}", scenes.variants.scene_of(row), solver_text(row))});
    const Field paper = row["paper"], clusters = paper["clusters"];  // null: Table 3 alone has this size
    if (scaled_down == 1)
      curve_named(chart, "frame, the paper's", Look::joined)
          .dots.push_back(
              {static_cast<double>(paper["particles"].count()), times(paper["frame_seconds"].number_or_null(), 1e3),
               clusters.is_nothing() ? std::string("the paper's, of its Table 3")
                                     : fmt::format("the paper's: {} clusters", io::grouped(clusters.count()))});
    if (!clusters.is_nothing()) add_row(table, columns, row);
  });
  sort_by_x(chart);
  scenes.show_stack(sheet);
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(table));
  scenes.show_tables(sheet, document, true);
  sheet.summary = "Times of the cut of a kidney at the samplings of the paper's tables.";
}

}  // namespace

const Suite kSamplingSuite = {"sampling", "rows", columns_of_sampling, add_sampling};

}  // namespace cutproof::report
