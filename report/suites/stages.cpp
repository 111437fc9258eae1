#include <map>

#include "model/io/columns.h"
#include "report/suites/over_sizes.h"

namespace cutproof::report {

namespace {

// A scene's medians, by what was timed, and those of the paper.
struct SceneTimes {
  std::string scene;
  int64_t particles = 0;
  std::map<std::string, std::string> ours, papers;
};

// As the paper has it, but with a row for each scene.
Grid table_1(const std::vector<SceneTimes>& scenes) {
  Grid table;
  table.title = "Table 1 of the paper, beside ours";
  table.words =
      "Medians in milliseconds. The paper's figures are of an Intel i7-10700F and an Nvidia RTX 2060; the "
      "device of ours stands at the top of this page.";
  table.columns = {{"scene"}, {"whose"}, {"particles", true}};
  for (const std::string_view stage : kStageNames) table.columns.push_back({std::string(stage), true});
  table.columns.push_back({"frame", true});
  for (const SceneTimes& one : scenes) {
    const auto add = [&](const char* whose, const std::string& particles, const auto& figures, const char* kind) {
      GridRow row = {{one.scene, whose, particles}, kind};
      while (row.cells.size() < table.columns.size()) {
        const auto found = figures.find(table.columns[row.cells.size()].head);
        row.cells.push_back(found == figures.end() || found->second.empty() ? "–" : found->second);
      }
      table.rows.push_back(std::move(row));
    };
    add("ours", io::grouped(one.particles), one.ours, "");
    if (!one.papers.empty()) add("the paper's", "–", one.papers, "paper");
  }
  return table;
}

void add_topologies(Sheet& sheet, const Field& scenes) {
  scenes.each([&](const Field& scene) {
    const Field topology = scene["topology"];
    if (!topology.is_there()) {
      sheet.notes.push_back(scene["scene"].text() +
                            ": errors were not measured, because at this size the reference would take minutes.");
      return;
    }
    topology.each([&](const Field& verdict) {
      if (verdict["holds"].flag()) return;
      sheet.holds = false;
      Card card;
      card.title = fmt::format("{}: {}", scene["scene"].text(), verdict["property"].text());
      card.words = verdict["witness"]["text"].text();
      if (sheet.cards.size() < kMostCards) sheet.cards.push_back(std::move(card));
    });
  });
}

RowColumns columns_of_stages() {
  return {{"what", "{what}"},
          {"particles", "{particles}", Shown::page},
          {"median [ms]", "{1e3*seconds/median:.4f}"},
          {"least [ms]", "{1e3*seconds/min:.4f}"},
          {"most [ms]", "{1e3*seconds/max:.4f}"},
          {"MB", "{1e-6*limit/bytes:.4g}", Shown::terminal},
          {"phases", "{limit/phases}", Shown::terminal},
          {"limit [ms]", "{1e3*limit/seconds:.4f}"},
          {"× limit", "{limit/multiple:.2f}"},
          {"frames", "{frames} of {of}"},
          {"paper [ms]", "{1e3*paper_seconds:.2f}"},
          {"error", "{error_text}"}};
}

void add_stages(Sheet& sheet, const Field& document) {
  const Field rows = document["rows"];
  const Variants variants(rows);
  Stack stack = stage_stack();
  Chart chart = over_particles("Time over size",
                               "Each stage and the whole frame by number of particles, both axes "
                               "logarithmic. Thin lines: the least that this machine could need.");
  const RowColumns columns = variants.named(columns_of_stages());
  Grid grid = grid_of("Every time, beside its limit and its error",
                      "The limit is what the machine would need at best for the bytes and the dependent launches of a "
                      "stage; the error is that of the same step, against the reference.",
                      columns, 1);
  std::vector<SceneTimes> scenes;
  std::set<int64_t> sizes;
  bool has_paper = false;
  // Rows of one scene stand one after the other and begin with whole frames.
  rows.each([&](const Field& row) {
    const std::string scene = variants.scene_of(row), what = row["what"].text();
    const int64_t particles = row["particles"].count();
    sizes.insert(particles);
    if (scenes.empty() || scenes.back().scene != scene) {
      scenes.push_back({scene, particles, {}, {}});
      stack.labels.push_back(scene);
      for (Series& part : stack.parts) part.values.emplace_back();
    }
    const std::optional<double> median = in_ms(row["seconds"]), paper = row["paper_seconds"].number_or_null();
    for (Series& part : stack.parts) {
      if (part.name == what) part.values.back() = median;
    }
    scenes.back().ours[what] = figure_text(median);
    if (paper) scenes.back().papers[what] = figure_text(paper, 1e3);
    has_paper = has_paper || paper;
    const auto size = static_cast<double>(particles);
    curve_named(chart, with(what, variants.of(row)), Look::joined)
        .dots.push_back({size, median, fmt::format("{} of {}: {}", what, scene, solver_text(row))});
    if (const Field limit = row["limit"]; !limit.is_nothing()) {
      const std::optional<double> least = times(limit["seconds"].number_or_null(), 1e3);
      if (least && *least > 0)
        curve_named(chart, "limit of " + what, Look::level).dots.push_back({size, least, "limit of " + what});
    }
    add_row(grid, columns, row);
  });
  show_stack(sheet, std::move(stack));
  if (sizes.size() > 1 && !has_paper) {
    sort_by_x(chart);
    sheet.pieces.emplace_back(std::move(chart));
  }
  if (has_paper) sheet.pieces.emplace_back(table_1(scenes));
  add_table_3(sheet, document, false);
  sheet.pieces.emplace_back(std::move(grid));
  add_topologies(sheet, document["scenes"]);
  sheet.summary = fmt::format("Times of whole frames and of each stage while a blade cuts, of {} {}.", scenes.size(),
                              scenes.size() == 1 ? "configuration" : "configurations");
}

}  // namespace

const Suite kStagesSuite = {"stages", "rows", columns_of_stages, add_stages};

}  // namespace cutproof::report
