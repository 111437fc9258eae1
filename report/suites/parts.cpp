#include "model/io/columns.h"
#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

std::string part_of(const Field& row) { return row["without"].is_nothing() ? "nothing" : row["without"].text(); }

std::string what_else(const Field& row) {
  const Field error = row["error"];
  if (error.is_nothing()) return row["refused"].text();
  if (row["without"].is_nothing()) {
    const Field judged = row["judged"];
    return fmt::format("beside the reference: step {} h, topology {}",
                       figure_text(judged["step_max_h"].number_or_null()),
                       judged["topology_holds"].flag() ? "holds" : "fails");
  }
  return error["same_components"].flag() ? "" : "the tissue falls into other parts";
}

std::string cost_of_a_resolved_particle(const Field& row) {
  const Field cost = row["per_resolved"];
  if (cost.is_nothing()) return "";
  return fmt::format("{} ± {}", figure_text(cost["seconds"].number_or_null(), 1e9),
                     figure_text(cost["standard_error"].number_or_null(), 1e9));
}

RowColumns columns_of_parts() {
  return {{"scene", "{scene}", Shown::page},
          {"without", part_of},
          {"median [ms]", "{1e3*seconds_per_frame/median:.3g}"},
          {"least [ms]", "{1e3*seconds_per_frame/min:.3g}"},
          {"most [ms]", "{1e3*seconds_per_frame/max:.3g}"},
          {"relative time", "{of_given:.2f}"},
          {"RMS [h]", "{error/rms_h:.2g}"},
          {"max [h]", "{error/max_h:.2g}"},
          {"removed otherwise", "{error/removed_otherwise}"},
          {"resolved particles", "{work/resolved:.4g}", Shown::page},
          {"what else", what_else}};
}

void add_parts(Sheet& sheet, const Field& document) {
  Chart chart = {"What the scene takes without a part, and how much else then happens",
                 "Each point is a run without one part: the farther left, the more the part costs; at zero distance "
                 "the tissue goes where it goes with it, so nobody would miss it but for what it makes.",
                 {"of the time as it is", "1", false},
                 {"RMS distance", "h", false},
                 {}};
  // What falls away without a floor would leave all else on one line.
  constexpr double kFarthest = 10;  // [h]
  int64_t beyond = 0, scenes = 0, runs = 0;
  const RowColumns columns = columns_of_parts();
  Grid grid = grid_of("Every run",
                      "Times are of a frame, relative to the scene as it is. The distance is from the run of the scene "
                      "as it is, in the worst of its frames: what the part does, and no error.",
                      columns, 1);
  std::string scene, stage;
  int64_t frames = 0;
  const RowColumns of_stage = {
      {"scene", [&](const Field&) { return scene; }},
      {"stage", [&](const Field&) { return stage; }},
      {"ms a frame", "{1e3*seconds_per_frame:.4g}"},
      {"frames", [&](const Field& one) { return fmt::format("{} of {}", one["frames"].count(), frames); }}};
  Grid stages = grid_of("Stages of the scenes as they are",
                        "Each stage alone, in the mean of all frames; and in how many of them it ran.", of_stage, 1);
  const RowColumns of_step = {{"scene", "{scene}"},
                              {"carried", "{work/carried:.4g}"},
                              {"in a grip", "{work/held:.4g}"},
                              {"resolved", "{work/resolved:.4g}"},
                              {"in no group", "{work/loose:.4g}"},
                              {"groups", "{work/groups:.4g}"},
                              {"a resolved one costs [ns]", cost_of_a_resolved_particle}};
  Grid steps = grid_of(
      "What a step does with particles, and what one by one costs",
      "In the mean of all steps: particles carried by the map of their group, likewise in a grip, one by one because a "
      "contact may touch their group, and in no group. What one that is resolved costs is read from how the times of "
      "steps go with their number, with its standard error; what else changes with it is in that.",
      of_step);
  document["rows"].each([&](const Field& row) {
    scene = row["scene"].text();
    const Field error = row["error"];
    const bool is_given = row["without"].is_nothing();
    ++(is_given ? scenes : runs);
    if (error.is_nothing()) return add_row(grid, columns, row, "warn");
    const bool holds = !is_given || row["judged"]["topology_holds"].flag();
    if (!holds) sheet.holds = false;
    add_row(grid, columns, row, holds ? "" : "bad");
    if (!is_given) {
      const std::optional<double> rms = error["rms_h"].number_or_null();
      if (rms && *rms > kFarthest) {
        ++beyond;
      } else {
        curve_named(chart, part_of(row), Look::dots)
            .dots.push_back({row["of_given"].number_or_null(), rms, fmt::format("{} without {}", scene, part_of(row))});
      }
      return;
    }
    frames = row["frames"].count();
    for (const std::string_view name : kStageNames) {
      stage = name;
      add_row(stages, of_stage, row["stages"][stage.c_str()]);
    }
    if (!row["work"].is_nothing()) add_row(steps, of_step, row);
  });
  if (beyond > 0) chart.words += fmt::format(" Not drawn, because beyond {} h: {}.", kFarthest, io::grouped(beyond));
  sheet.summary = fmt::format("What each part of {} {} costs: {} runs without one.", io::grouped(scenes),
                              scenes == 1 ? "scene" : "scenes", io::grouped(runs));
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
  sheet.pieces.emplace_back(std::move(stages));
  if (!steps.rows.empty()) sheet.pieces.emplace_back(std::move(steps));
}

}  // namespace

const Suite kPartsSuite = {"parts", "rows", columns_of_parts, add_parts};

}  // namespace cutproof::report
