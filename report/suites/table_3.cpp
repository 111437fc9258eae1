#include <algorithm>

#include "model/io/columns.h"
#include "report/paper_comparison.h"
#include "report/suites/over_sizes.h"

namespace cutproof::report {

namespace {

// Within 2 %: a body takes whole layers of nodes, so it never has exactly as many.
bool is_about(int64_t ours, int64_t theirs) { return 50 * std::abs(ours - theirs) <= theirs; }

}  // namespace

void add_table_3(Sheet& sheet, const Field& document, bool is_asked) {
  struct Kidney {
    int64_t particles;
    std::string ms, text;
  };
  std::vector<Kidney> kidneys;
  document["rows"].each([&](const Field& row) {
    const std::string scene = row["scene"].text();
    // Of `stages` a row has one time, else that of the frame and those of all stages.
    const Field what = row["what"], seconds = row["seconds"];
    if (!scene.starts_with("kidney") || what.text_or("frame") != "frame") return;
    kidneys.push_back({row["particles"].count(), figure_text(in_ms(what.is_there() ? seconds : seconds["frame"])),
                       with(scene, row["cooking"].text_or("")) + "; " + solver_text(row)});
  });
  Grid table;
  table.title = "Table 3 of the paper, beside ours";
  table.columns = {{"particles", true}};
  for (const char* const work : kComparedWorks) table.columns.push_back({work, true});
  for (const Column& column : {Column{"ours: frame", true}, {"ours: particles", true}, {"ours: what"}})
    table.columns.push_back(column);
  std::string missing;
  for (const ComparedSize& size : kComparedSizes) {
    std::vector<std::string> cells = {io::grouped(size.particles)};
    for (const double ms : size.frame_ms) cells.push_back(fmt::format("{:.1f}", ms));
    bool is_there = false;
    for (const Kidney& kidney : kidneys) {
      if (!is_about(kidney.particles, size.particles)) continue;
      GridRow made = {cells};
      made.cells.insert(made.cells.end(), {kidney.ms, io::grouped(kidney.particles), kidney.text});
      table.rows.push_back(std::move(made));
      is_there = true;
    }
    if (is_there) continue;
    missing += (missing.empty() ? "" : ", ") + io::grouped(size.particles);
    cells.insert(cells.end(), {"–", "–", "not measured in this document"});
    table.rows.push_back({std::move(cells), "paper"});
  }
  const bool is_any =
      std::any_of(table.rows.begin(), table.rows.end(), [](const GridRow& row) { return row.kind != "paper"; });
  if (!is_any && !is_asked) return;
  table.words =
      "Comparison with previous works: milliseconds a frame, by number of particles. Their columns and the paper's "
      "are as the paper gives them; its machine was an Intel i7-10700F with an Nvidia RTX 2060.";
  if (is_any) {
    table.words += fmt::format(
        " Ours are medians of a whole frame on another machine: {}. So ours beside theirs compares machines as well "
        "as methods, and no ratio is given.",
        document["device"].text());
  }
  if (!missing.empty()) table.words += " Not measured in this document: kidneys of about " + missing + " particles.";
  sheet.pieces.emplace_back(std::move(table));
}

}  // namespace cutproof::report
