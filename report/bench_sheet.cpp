// Benchmarks: a reader for each suite.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "model/io/columns.h"
#include "report/document_fields.h"
#include "report/paper_comparison.h"

namespace cutproof::report {

namespace {

std::optional<double> times(const std::optional<double>& value, double factor) {
  return value ? std::optional(factor * *value) : std::nullopt;
}
std::optional<double> in_ms(const Field& field) { return times(seconds_of(field), 1e3); }
std::string ms_text(const Field& field, const char* which = "median") {
  return figure_text(seconds_of(field, which), 1e3);
}
std::string whole(int64_t count) { return io::grouped(count); }

// A curve of a name, made when it is first asked for.
Curve& curve_named(Chart& chart, const std::string& name, Look look) {
  for (Curve& curve : chart.curves) {
    if (curve.name == name) return curve;
  }
  return chart.curves.emplace_back(Curve{name, look, {}});
}

// Times and limits over particles, from row to row.
Chart over_particles(const std::string& title, const std::string& words) {
  return {title, words, {"particles", "", true}, {"median time", "ms", true}, {}};
}
void sort_by_x(Chart& chart) {
  for (Curve& curve : chart.curves) {
    std::stable_sort(curve.dots.begin(), curve.dots.end(), [](const Dot& a, const Dot& b) { return a.x < b.x; });
  }
}

// What sets one row apart from another of the same scene, where rows differ in it.
class Variants {
 public:
  explicit Variants(const Field& rows) {
    rows.each([&](const Field& row) {
      for (std::size_t k = 0; k < std::size(kNames); ++k) seen_[k].insert(row[kNames[k]].text_or(""));
    });
  }
  std::string of(const Field& row) const {
    std::string text;
    for (std::size_t k = 0; k < std::size(kNames); ++k) {
      const std::string value = row[kNames[k]].text_or("");
      if (seen_[k].size() < 2 || value.empty()) continue;
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kNames[k], value);
    }
    return text;
  }

 private:
  static constexpr const char* kNames[] = {"cooking", "acceleration", "remove"};
  std::set<std::string> seen_[std::size(kNames)];
};
std::string with(const std::string& name, const std::string& variant) {
  return variant.empty() ? name : name + ", " + variant;
}

std::string solver_text(const Field& row) {
  return fmt::format("{} substeps × {} iterations, acceleration {}", row["substeps"].count(), row["iterations"].count(),
                     row["acceleration"].text());
}

// Kidneys that a document has timed, beside Table 3 of the paper: those of about as many particles as it has.
class Table3 {
 public:
  void add(const Field& row, const std::string& scene, const std::optional<double>& ms) {
    if (!scene.starts_with("kidney")) return;
    std::string text = with(scene, row["cooking"].text_or(""));
    rows_.push_back({row["particles"].count(), ms, text + "; " + solver_text(row)});
  }
  // `is_asked`: the document is about the paper's sizes, so that none of them was measured is said as well.
  void show(Sheet& sheet, const Field& document, bool is_asked) const {
    Grid table;
    table.title = "Table 3 of the paper, beside ours";
    table.columns = {{"particles", true}};
    for (const char* const work : kComparedWorks) table.columns.push_back({work, true});
    for (const Column& column : {Column{"ours: frame", true}, {"ours: particles", true}, {"ours: what"}})
      table.columns.push_back(column);
    std::string missing;
    for (const ComparedSize& size : kComparedSizes) {
      std::vector<std::string> cells = {whole(size.particles)};
      for (const double ms : size.frame_ms) cells.push_back(fmt::format("{:.1f}", ms));
      bool is_there = false;
      for (const Row& row : rows_) {
        if (!is_about(row.particles, size.particles)) continue;
        GridRow made = {cells};
        made.cells.insert(made.cells.end(), {figure_text(row.ms), whole(row.particles), row.text});
        table.rows.push_back(std::move(made));
        is_there = true;
      }
      if (is_there) continue;
      missing += (missing.empty() ? "" : ", ") + whole(size.particles);
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

 private:
  struct Row {
    int64_t particles;
    std::optional<double> ms;
    std::string text;
  };
  // Within 2 %: a body takes whole layers of nodes, so it never has exactly as many.
  static bool is_about(int64_t ours, int64_t theirs) { return 50 * std::abs(ours - theirs) <= theirs; }
  std::vector<Row> rows_;
};

Stack stage_stack(const std::string& words) {
  Stack stack = {"Time of each stage", words, "ms", {}, {}};
  for (const Stage stage : kStages) stack.parts.push_back({std::string(name_of(stage)), {}});
  return stack;
}
constexpr const char* kStackWords =
    "Medians of spans of one stage, one above the other. A frame runs them as one piece, so it may take less than "
    "their "
    "sum; its own time is in the table. A stage that did not run has no part.";

void drop_empty_parts(Stack& stack) {
  std::erase_if(stack.parts, [](const Series& part) {
    return std::none_of(part.values.begin(), part.values.end(), [](const auto& value) { return value && *value > 0; });
  });
}

// --- stages: rows of one scene stand one after the other and begin with whole frames

void stages_pieces(Sheet& sheet, const Field& document) {
  const Field rows = document["rows"];
  const Variants variants(rows);
  Stack stack = stage_stack(kStackWords);
  Chart chart = over_particles("Time over size",
                               "Each stage and the whole frame by number of particles, both axes "
                               "logarithmic. Thin lines: the least that this machine could need.");
  Grid grid;
  grid.title = "Every time, beside its limit and its error";
  grid.words =
      "The limit is what the machine would need at best for the bytes and the dependent launches of a stage; "
      "the error is that of the same step, against the reference.";
  grid.columns = {{"scene"},
                  {"what"},
                  {"particles", true},
                  {"median [ms]", true},
                  {"least [ms]", true},
                  {"most [ms]", true},
                  {"limit [ms]", true},
                  {"× limit", true},
                  {"frames", true},
                  {"paper [ms]", true},
                  {"error"}};
  grid.filter = 1;
  Table3 table_3;
  std::vector<std::string> scenes;
  std::map<std::string, std::map<std::string, std::string>> ours, papers;  // [scene][what]
  std::map<std::string, std::string> particles_of;
  std::set<int64_t> sizes;
  rows.each([&](const Field& row) {
    const std::string scene = with(row["scene"].text(), variants.of(row)), what = row["what"].text();
    const int64_t particles = row["particles"].count();
    sizes.insert(particles);
    if (scenes.empty() || scenes.back() != scene) {
      scenes.push_back(scene);
      stack.labels.push_back(scene);
      for (Series& part : stack.parts) part.values.emplace_back();
      particles_of[scene] = whole(particles);
    }
    const Field seconds = row["seconds"], limit = row["limit"];
    const std::optional<double> median = in_ms(seconds), paper = times(row["paper_seconds"].number_or_null(), 1e3);
    for (Series& part : stack.parts) {
      if (part.name == what) part.values.back() = median;
    }
    ours[scene][what] = figure_text(median);
    if (paper) papers[scene][what] = figure_text(paper);
    if (what == "frame") table_3.add(row, row["scene"].text(), median);
    const auto size = static_cast<double>(particles);
    const std::string text = fmt::format("{} of {}: {}", what, scene, solver_text(row));
    const std::string variant = variants.of(row);
    curve_named(chart, with(what, variant), Look::joined).dots.push_back({size, median, text});
    std::optional<double> least, multiple;
    if (!limit.is_nothing()) {
      least = times(limit["seconds"].number_or_null(), 1e3);
      multiple = limit["multiple"].number_or_null();
      if (least && *least > 0)
        curve_named(chart, "limit of " + what, Look::level).dots.push_back({size, least, "limit of " + what});
    }
    grid.rows.push_back(
        {{scene, what, whole(particles), figure_text(median), ms_text(seconds, "min"), ms_text(seconds, "max"),
          figure_text(least), figure_text(multiple), fmt::format("{} of {}", row["frames"].count(), row["of"].count()),
          figure_text(paper), row["error_text"].text_or("")}});
  });
  drop_empty_parts(stack);
  const bool has_paper = !papers.empty();
  if (!stack.labels.empty()) sheet.pieces.emplace_back(std::move(stack));
  if (sizes.size() > 1 && !has_paper) {
    sort_by_x(chart);
    sheet.pieces.emplace_back(std::move(chart));
  }
  if (has_paper) {
    Grid table;
    table.title = "Table 1 of the paper, beside ours";
    table.words =
        "Medians in milliseconds. The paper's figures are of an Intel i7-10700F and an Nvidia RTX 2060; the "
        "device of ours stands at the top of this page.";
    table.columns = {{"scene"}, {"whose"}, {"particles", true}};
    for (const Stage stage : kStages) table.columns.push_back({std::string(name_of(stage)), true});
    table.columns.push_back({"frame", true});
    for (const std::string& scene : scenes) {
      const auto add = [&](const char* whose, const std::string& particles, auto& figures, const char* kind) {
        GridRow row = {{scene, whose, particles}, kind};
        while (row.cells.size() < table.columns.size()) {
          const auto found = figures.find(table.columns[row.cells.size()].head);
          row.cells.push_back(found == figures.end() || found->second.empty() ? "–" : found->second);
        }
        table.rows.push_back(std::move(row));
      };
      add("ours", particles_of[scene], ours[scene], "");
      if (const auto found = papers.find(scene); found != papers.end()) add("the paper's", "–", found->second, "paper");
    }
    sheet.pieces.emplace_back(std::move(table));
  }
  table_3.show(sheet, document, false);
  sheet.pieces.emplace_back(std::move(grid));
  int64_t failing = 0;
  document["scenes"].each([&](const Field& scene) {
    const Field topology = scene["topology"];
    if (!topology.is_there()) {
      sheet.notes.push_back(scene["scene"].text() +
                            ": errors were not measured, because at this size the reference would take minutes.");
      return;
    }
    topology.each([&](const Field& verdict) {
      if (verdict["holds"].flag()) return;
      ++failing;
      Card card;
      card.title = fmt::format("{}: {}", scene["scene"].text(), verdict["property"].text());
      card.words = verdict["witness"]["text"].text();
      if (sheet.cards.size() < kMostCards) sheet.cards.push_back(std::move(card));
    });
  });
  if (failing > 0) sheet.holds = false;
  sheet.summary = fmt::format("Times of whole frames and of each stage while a blade cuts, of {} {}.", scenes.size(),
                              scenes.size() == 1 ? "configuration" : "configurations");
}

// --- scale and sampling: a row has all stages

void add_scene_rows(Sheet& sheet, const Field& document, bool is_sampling) {
  const Field rows = document["rows"];
  const Variants variants(rows);
  const bool is_whole = !is_sampling || document["scaled_down"].count() == 1;
  Stack stack = stage_stack(kStackWords);
  Chart chart = over_particles("Time over size",
                               is_sampling ? "A whole frame by number of particles, ours and the paper's, both axes "
                                             "logarithmic."
                                           : "Each stage and the whole frame by number of particles, both axes "
                                             "logarithmic.");
  Chart memory = {"Memory over size",
                  "What the backend keeps after the timed frames, for each particle.",
                  {"particles", "", true},
                  {"memory of a particle", "bytes", false},
                  {}};
  Grid table;
  if (is_sampling) {
    table.title = "Table 2 of the paper, beside ours";
    table.words = is_whole
                      ? "The discontinuous cut of a kidney at four samplings. “To first”: the frame's time over that "
                        "of the first row."
                      : fmt::format(
                            "The discontinuous cut of a kidney at four samplings, of 1/{} of the paper's "
                            "particles: --full takes them all. “To first”: the frame's time over that of "
                            "the first row.",
                            document["scaled_down"].count());
    table.columns = {{"particles", true},         {"clusters", true},         {"frame [ms]", true},
                     {"to first", true},          {"paper: particles", true}, {"paper: clusters", true},
                     {"paper: frame [ms]", true}, {"paper: to first", true}};
  }
  Grid grid;
  grid.title = "Every time, beside its error";
  grid.words =
      "Medians in milliseconds. The error is the greatest distance of a position after one step from the "
      "reference's, in particle spacings h.";
  grid.columns = {{"scene"}, {"particles", true}, {"clusters", true}};
  for (const Stage stage : kStages) grid.columns.push_back({std::string(name_of(stage)), true});
  for (const char* const head : {"frame", "least", "most"}) grid.columns.push_back({head, true});
  if (!is_sampling) {
    grid.columns.push_back({"million particles/s", true});
    grid.columns.push_back({"bytes/particle", true});
  }
  grid.columns.push_back({"error of step [h]", true});
  grid.columns.push_back({"topology"});
  int64_t failing = 0;
  Table3 table_3;
  rows.each([&](const Field& row) {
    const std::string variant = variants.of(row), scene = with(row["scene"].text(), variant);
    const int64_t particles = row["particles"].count();
    const auto size = static_cast<double>(particles);
    const Field seconds = row["seconds"], error = row["error"];
    stack.labels.push_back(scene);
    GridRow cells = {{scene, whole(particles), whole(row["clusters"].count())}};
    std::size_t part = 0;
    for (const Stage stage : kStages) {
      const std::string name(name_of(stage));
      const std::optional<double> median = in_ms(seconds[name.c_str()]);
      stack.parts[part++].values.push_back(median);
      cells.cells.push_back(figure_text(median));
      if (!is_sampling && median)
        curve_named(chart, with(name, variant), Look::joined)
            .dots.push_back({size, median, fmt::format("{} of {}: {}", name, scene, solver_text(row))});
    }
    const Field frame = seconds["frame"];
    curve_named(chart, with(is_sampling ? "frame, ours" : "frame", variant), Look::joined)
        .dots.push_back({size, in_ms(frame), fmt::format("frame of {}: {}", scene, solver_text(row))});
    table_3.add(row, row["scene"].text(), in_ms(frame));
    for (const char* const which : {"median", "min", "max"}) cells.cells.push_back(ms_text(frame, which));
    if (!is_sampling) {
      const std::optional<double> bytes = row["bytes"].number_or_null();
      const std::optional<double> of_one = bytes && size > 0 ? std::optional(*bytes / size) : std::nullopt;
      cells.cells.push_back(figure_text(row["particles_per_second"].number_or_null(), 1e-6));
      cells.cells.push_back(of_one ? fmt::format("{:.0f}", *of_one) : "–");
      curve_named(memory, with("memory", variant), Look::joined)
          .dots.push_back({size, of_one, fmt::format("{}: {} clusters", scene, row["clusters"].count())});
    } else {
      const Field paper = row["paper"];
      const std::optional<double> theirs = times(paper["frame_seconds"].number_or_null(), 1e3);
      const int64_t their_particles = paper["particles"].count();
      const Field their_clusters = paper["clusters"];  // null: of a size of Table 3 alone, which has no clusters
      if (is_whole)
        curve_named(chart, "frame, the paper's", Look::joined)
            .dots.push_back({static_cast<double>(their_particles), theirs,
                             their_clusters.is_nothing()
                                 ? std::string("the paper's, of its Table 3")
                                 : fmt::format("the paper's: {} clusters", whole(their_clusters.count()))});
      const auto ratio = [](const Field& field) {
        const auto value = field.number_or_null();
        return value ? fmt::format("{:.2f}", *value) : std::string("–");
      };
      if (!their_clusters.is_nothing()) {
        table.rows.push_back({{whole(particles), whole(row["clusters"].count()), ms_text(frame),
                               ratio(row["frame_to_first"]), whole(their_particles), whole(their_clusters.count()),
                               figure_text(theirs), ratio(paper["frame_to_first"])}});
      }
    }
    const Field step = error["step"], whole_frame = error["frame"];
    cells.cells.push_back(step.is_nothing() ? "not measured" : figure_text(step["max_h"].number_or_null()));
    const bool holds = whole_frame.is_nothing() || whole_frame["topology_holds"].flag();
    cells.cells.push_back(whole_frame.is_nothing() ? "not judged" : holds ? "holds" : "fails");
    if (!holds) {
      cells.kind = "bad";
      ++failing;
    }
    grid.rows.push_back(std::move(cells));
  });
  if (failing > 0) sheet.holds = false;
  drop_empty_parts(stack);
  sort_by_x(chart);
  sort_by_x(memory);
  if (!is_sampling) sheet.pieces.emplace_back(std::move(chart));
  if (!stack.labels.empty()) sheet.pieces.emplace_back(std::move(stack));
  if (is_sampling) {
    sheet.pieces.emplace_back(std::move(chart));
    sheet.pieces.emplace_back(std::move(table));
  } else {
    sheet.pieces.emplace_back(std::move(memory));
  }
  table_3.show(sheet, document, is_sampling);
  sheet.pieces.emplace_back(std::move(grid));
  sheet.summary = is_sampling ? "Times of the cut of a kidney at the samplings of the paper's tables."
                              : "Times of a frame and of its stages, and memory, by number of particles.";
}
void scale_pieces(Sheet& sheet, const Field& document) { add_scene_rows(sheet, document, false); }
void sampling_pieces(Sheet& sheet, const Field& document) { add_scene_rows(sheet, document, true); }

// --- clusters: how many there are while a kidney is cut through

void clusters_pieces(Sheet& sheet, const Field& document) {
  Chart chart = {"Clusters during a cut",
                 "How many clusters there are after each frame, for each threshold τ of merging.",
                 {"frame of the scene", "", false},
                 {"clusters", "", false},
                 {}};
  Grid grid;
  grid.title = "Growth for each τ";
  const double wanted = document["wanted_growth"].number();
  grid.words = fmt::format("Growth from the first frame to the last. The paper's is {:.3g} %; {:.3g} % are wanted.",
                           100 * document["paper"]["growth"].number(), 100 * wanted);
  grid.columns = {{"merging"},         {"growth [%]", true}, {"greatest growth [%]", true}, {"as wanted"},
                  {"particles", true}, {"removed", true},    {"frame, median [ms]", true},  {"verdicts", true},
                  {"failed", true}};
  int64_t failing = 0;
  document["rows"].each([&](const Field& row) {
    const Field tau = row["tau"], frames = row["scene_frame"], counts = row["clusters"];
    const std::string name = tau.is_nothing() ? "no merging" : fmt::format("τ = {:.4g}", tau.number());
    if (frames.length() != counts.length()) counts.refuse("this has not as many entries as 'scene_frame'");
    Curve curve = {name, Look::joined, {}};
    for (std::size_t k = 0; k < frames.length(); ++k)
      curve.dots.push_back(
          {static_cast<double>(frames.at(k).count()), static_cast<double>(counts.at(k).count()), name});
    chart.curves.push_back(std::move(curve));
    const Field error = row["error"];
    const std::size_t failed = error["failed"].length();
    failing += failed > 0;
    grid.rows.push_back(
        {{name, figure_text(row["growth"].number_or_null(), 100),
          figure_text(row["greatest_growth"].number_or_null(), 100), row["within_wanted"].flag() ? "yes" : "no",
          whole(row["particles"].count()), whole(row["removed"].count()), ms_text(row["seconds"]),
          whole(error["verdicts"].count()), whole(static_cast<int64_t>(failed))},
         failed > 0 ? "bad" : ""});
  });
  if (failing > 0) sheet.holds = false;
  sheet.summary = "How the number of clusters grows while a kidney is cut through.";
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
}

// --- rotations

void rotations_pieces(Sheet& sheet, const Field& document) {
  std::map<std::string, Chart> charts;
  std::map<std::string, std::vector<Dot>> fronts;
  Grid grid;
  grid.title = "Methods";
  grid.words =
      "Worst over all hard cases. A gap says by how much the answer is worse than the best rotation, relative to "
      "it. “On the front”: no other method of this precision is both as fast and as near.";
  grid.columns = {{"method"},          {"precision"},   {"ms a million", true},    {"× limit", true},
                  {"worst gap", true}, {"in the case"}, {"worst ‖RᵀR − I‖", true}, {"answers", true},
                  {"wrong", true},     {"on the front"}};
  grid.filter = 1;
  document["methods"].each([&](const Field& method) {
    const std::string name = method["method"].text(), precision = method["precision"].text();
    if (precision != "single" && precision != "double")
      method["precision"].refuse("'" + precision + "' is no precision");
    const Field near = method["near_seconds_per_million"];
    const std::optional<double> gap = method["worst_gap"].number_or_null();
    const int64_t wrong = method["wrong"].count();
    const bool is_default = method["default"].flag();
    const std::string text = fmt::format("{}{}, {} precision; worst case {}, {} of {} answers wrong", name,
                                         is_default ? " (the default)" : "", precision,
                                         method["worst_case"].is_nothing() ? "–" : method["worst_case"].text(),
                                         whole(wrong), whole(method["answers"].count()));
    Chart& chart = charts
                       .try_emplace(precision, Chart{"Speed against error, " + precision + " precision",
                                                     "Left is faster, below is nearer to the best rotation. The thin "
                                                     "line joins the methods that no other beats in both.",
                                                     {"median time of a million matrices", "ms", true},
                                                     {"worst gap to the best rotation", "1", true},
                                                     {}})
                       .first->second;
    const Dot dot = {in_ms(near), gap, text};
    curve_named(chart,
                wrong > 0    ? "some answers wrong"
                : is_default ? "the default"
                             : "all answers right",
                Look::dots)
        .dots.push_back(dot);
    const bool on_front = method["on_front"].flag();
    if (on_front) fronts[precision].push_back(dot);
    grid.rows.push_back({{name + (is_default ? " (default)" : ""), precision, ms_text(near),
                          figure_text(method["multiple_of_limit"].number_or_null()), figure_text(gap),
                          method["worst_case"].is_nothing() ? "–" : method["worst_case"].text(),
                          figure_text(method["worst_orthogonality"].number_or_null()), whole(method["answers"].count()),
                          whole(wrong), on_front ? "yes" : "no"},
                         wrong > 0  ? "warn"
                         : on_front ? "good"
                                    : ""});
  });
  Grid cases;
  cases.title = "Every method in every case";
  cases.words = "The hard cases are described in the documentation (method, Hard cases).";
  cases.columns = {
      {"case"},         {"method"}, {"precision"}, {"worst gap", true}, {"wrong", true}, {"reflections", true},
      {"flagged", true}};
  cases.filter = 1;
  document["rows"].each([&](const Field& row) {
    const int64_t wrong = row["wrong"].count();
    cases.rows.push_back({{row["case"].text(), row["method"].text(), row["precision"].text(),
                           figure_text(row["worst_gap"].number_or_null()), whole(wrong),
                           whole(row["reflections"].count()), whole(row["flagged"].count())},
                          wrong > 0 ? "warn" : ""});
  });
  for (const char* const precision : {"single", "double"}) {
    const auto found = charts.find(precision);
    if (found == charts.end()) continue;
    found->second.curves.push_back(front_of(fronts[precision], "the best"));
    sheet.pieces.emplace_back(std::move(found->second));
  }
  sheet.summary = "Every way of finding the best rotation, on hard cases, and its time.";
  sheet.pieces.emplace_back(std::move(grid));
  sheet.pieces.emplace_back(std::move(cases));
}

// --- solver

void solver_pieces(Sheet& sheet, const Field& document) {
  const double tolerance = document["tolerance_h"].number();
  Grid grid;
  grid.title = "Every row";
  grid.words = "Errors are distances from the reference solution, in particle spacings h.";
  grid.columns = {{"scene"},           {"acceleration"},       {"iterations", true},
                  {"ms a step", true}, {"greatest [h]", true}, {"RMS [h]", true},
                  {"energy gap", true}};
  grid.filter = 0;
  document["scenes"].each([&](const Field& scene) {
    const std::string name =
        fmt::format("{}, k = {:.3g} s⁻², {} {}", scene["scene"].text(), scene["stiffness"].number(),
                    scene["substeps"].count(), scene["substeps"].count() == 1 ? "substep" : "substeps");
    Chart chart = {
        "Speed against error: " + name,
        fmt::format("{} particles in {} clusters. Each point is a number of iterations; left is faster, below "
                    "is nearer to the reference solution.",
                    whole(scene["particles"].count()), whole(scene["clusters"].count())),
        {"median time of a step", "ms", true},
        {"greatest distance", "h", true},
        {}};
    std::vector<Dot> all;
    scene["rows"].each([&](const Field& row) {
      const std::string acceleration = row["acceleration"].text();
      const std::optional<double> ms = in_ms(row["seconds"]), most = row["max_h"].number_or_null();
      const Dot dot = {ms, most,
                       fmt::format("{} iterations, acceleration {}", row["iterations"].count(), acceleration)};
      curve_named(chart, "acceleration " + acceleration, Look::joined).dots.push_back(dot);
      all.push_back(dot);
      grid.rows.push_back(
          {{name, acceleration, whole(row["iterations"].count()), figure_text(ms), figure_text(most),
            figure_text(row["rms_h"].number_or_null()), figure_text(row["energy_gap"].number_or_null())}});
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

// --- machine_limits

void machine_limits_pieces(Sheet& sheet, const Field& document) {
  Grid grid;
  grid.title = "What this machine can do at best";
  grid.words = "Times of other benchmarks are given as multiples of these.";
  grid.columns = {{"what"},       {"median [ms]", true}, {"least [ms]", true}, {"most [ms]", true},
                  {"GB/s", true}, {"lost", true}};
  document["rows"].each([&](const Field& row) {
    const std::optional<double> lost = row["lost"].number_or_null();
    if (lost && *lost > 0) sheet.holds = false;
    grid.rows.push_back(
        {{row["what"].text(), ms_text(row["seconds"]), ms_text(row["seconds"], "min"), ms_text(row["seconds"], "max"),
          figure_text(row["bytes_per_second"].number_or_null(), 1e-9), figure_text(lost)},
         lost && *lost > 0 ? "bad" : ""});
  });
  sheet.summary = "The limits of the machine: copies and launches.";
  sheet.pieces.emplace_back(std::move(grid));
}

// --- baselines

void baselines_pieces(Sheet& sheet, const Field& document) {
  Chart chart = {"Speed against the error of the cut",
                 "Each point is a method. The distance is the Hausdorff distance: the lower, the nearer the skin of "
                 "the cut lies to the ideal cut; left is faster.",
                 {"median time of a frame", "ms", true},
                 {"distance from the ideal cut", "h", false},
                 {}};
  Grid grid;
  grid.title = "Methods";
  grid.words =
      "Components of the tissue, of the coupling, and shells of the skin must be equal in every frame; "
      "“isolated” counts groups of clusters that are coupled to nothing inside connected tissue.";
  grid.columns = {{"method"},
                  {"source"},
                  {"frame [ms]", true},
                  {"components", true},
                  {"couplings", true},
                  {"shells", true},
                  {"frames where they differ", true},
                  {"isolated", true},
                  {"removed", true},
                  {"Hausdorff [h]", true},
                  {"lost volume [h³]", true},
                  {"interpenetration [h³]", true}};
  document["rows"].each([&](const Field& row) {
    const std::string name = row["name"].text();
    const int64_t unequal = row["unequal_frames"].count(), isolated = row["isolated"].count();
    const Field geometry = row["geometry"];
    const std::optional<double> distance =
        geometry.is_nothing() ? std::nullopt : geometry["hausdorff"].number_or_null();
    const Field settings = row["settings"];
    const std::string text = fmt::format("{} ({}): expand {}, merge {}, detect {}, deletion {}", name,
                                         row["source"].text(), settings["expand"].text(), settings["merge"].text(),
                                         settings["detect"].text(), settings["deletion"].text());
    const bool is_right = unequal == 0 && isolated == 0;
    curve_named(chart, is_right ? "components always equal, none isolated" : "unequal or isolated in some frame",
                Look::dots)
        .dots.push_back({in_ms(row["seconds"]), distance, text});
    const Field volume = row["interpenetration"];
    grid.rows.push_back({{name, row["source"].text(), ms_text(row["seconds"]), whole(row["components"].count()),
                          whole(row["couplings"].count()), whole(row["shells"].count()), whole(unequal),
                          whole(isolated), whole(row["removed"].count()), figure_text(distance),
                          geometry.is_nothing() ? "–" : figure_text(geometry["lost_volume"].number_or_null()),
                          volume.is_nothing() ? "–" : figure_text(volume["volume"].number_or_null())},
                         is_right ? "" : "warn"});
  });
  sheet.summary = fmt::format("This method beside others, on the same kidney of {} particles.",
                              whole(document["particles"].count()));
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
}

// --- sensitivity

void sensitivity_pieces(Sheet& sheet, const Field& document) {
  // Sizes of one unit share a plot: a length and a weight have no common axis.
  std::map<std::string, Chart> charts;
  std::vector<std::string> units;
  Grid grid;
  grid.title = "Every disturbance";
  grid.words =
      "The least size of a disturbance that some property rejects, beside what rounding does to the same figure. "
      "The goal is ten times rounding.";
  grid.columns = {{"scene"},
                  {"stage"},
                  {"disturbance"},
                  {"unit"},
                  {"least rejected", true},
                  {"rounding", true},
                  {"ratio", true},
                  {"goal", true},
                  {"within the goal"},
                  {"rejected by"}};
  grid.filter = 1;
  int64_t within = 0, judged = 0;
  document["rows"].each([&](const Field& row) {
    const std::string scene = row["scene"].text(), disturbance = row["disturbance"].text(), unit = row["unit"].text();
    const std::string stage(name_of(row["stage"].stage()));
    const std::optional<double> least = row["least"].number_or_null(), rounding = row["rounding"].number_or_null();
    const std::string property = row["property"].is_nothing() ? "nothing" : row["property"].text();
    const Field goal = row["within_goal"];
    const bool has_goal = !goal.is_nothing();
    if (has_goal) {
      ++judged;
      within += goal.flag();
    }
    if (rounding && *rounding > 0 && least) {
      if (!charts.contains(unit)) units.push_back(unit);
      Chart& chart =
          charts
              .try_emplace(unit, Chart{"Least size that is rejected, in " + (unit == "1" ? "relative terms" : unit),
                                       "Each point is a disturbance. The nearer to the diagonal line, ten "
                                       "times what rounding does, the sharper the judge.",
                                       {"what rounding does", unit, true},
                                       {"least size that is rejected", unit, true},
                                       {}})
              .first->second;
      curve_named(chart, stage, Look::dots)
          .dots.push_back(
              {rounding, least, fmt::format("{} after {} in {}: rejected by {}", disturbance, stage, scene, property)});
    }
    grid.rows.push_back(
        {{scene, stage, disturbance, unit, least ? figure_text(least) : "not rejected at all", figure_text(rounding),
          figure_text(row["ratio"].number_or_null()), figure_text(row["goal"].number_or_null()),
          !has_goal     ? "no goal"
          : goal.flag() ? "yes"
                        : "no",
          property},
         !least                     ? "bad"
         : has_goal && !goal.flag() ? "warn"
                                    : ""});
  });
  for (const std::string& unit : units) {
    Chart& chart = charts[unit];
    double low = INFINITY, high = 0;
    for (const Curve& curve : chart.curves) {
      for (const Dot& dot : curve.dots) {
        low = std::min(low, *dot.x);
        high = std::max(high, *dot.x);
      }
    }
    chart.curves.push_back({"ten times rounding",
                            Look::level,
                            {{low, 10 * low, "ten times rounding"}, {high, 10 * high, "ten times rounding"}}});
    sheet.pieces.emplace_back(std::move(chart));
  }
  sheet.summary =
      fmt::format("How small a fault the judge still rejects: {} of {} disturbances that have a goal are within it.",
                  whole(within), whole(judged));
  sheet.pieces.emplace_back(std::move(grid));
}

// --- parts

void parts_pieces(Sheet& sheet, const Field& document) {
  Chart chart = {"What the scene takes without a part, and how much else then happens",
                 "Each point is a run without one part: the farther left, the more the part costs; at zero distance "
                 "the tissue goes where it goes with it, so nobody would miss it but for what it makes.",
                 {"of the time as it is", "1", false},
                 {"RMS distance", "h", false},
                 {}};
  // What falls away without a floor would leave all else on one line.
  constexpr double kFarthest = 10;  // [h]
  int64_t beyond = 0;
  Grid grid;
  grid.title = "Every run";
  grid.words =
      "The distance is from the run of the scene as it is, in the worst of its frames: what the part does, and no "
      "error.";
  grid.columns = {{"scene"},
                  {"without"},
                  {"median [ms]", true},
                  {"least [ms]", true},
                  {"most [ms]", true},
                  {"of the time as it is", true},
                  {"RMS [h]", true},
                  {"max [h]", true},
                  {"removed otherwise", true},
                  {"resolved particles", true},
                  {"what else"}};
  grid.filter = 1;
  Grid stages;
  stages.title = "Stages of the scenes as they are";
  stages.words = "Each stage alone, in the mean of all frames; and in how many of them it ran.";
  stages.columns = {{"scene"}, {"stage"}, {"ms a frame", true}, {"frames", true}};
  stages.filter = 1;
  Grid each;
  each.title = "What a step does with particles, and what one by one costs";
  each.words =
      "In the mean of all steps: particles carried by the map of their group, likewise in a grip, one by one because a "
      "contact may touch their group, and in no group. What one that is resolved costs is read from how the times of "
      "steps go with their number, with its standard error; what else changes with it is in that.";
  each.columns = {{"scene"},
                  {"carried", true},
                  {"in a grip", true},
                  {"resolved", true},
                  {"in no group", true},
                  {"groups", true},
                  {"a resolved one costs [ns]", true}};
  int64_t scenes = 0, runs = 0;
  document["rows"].each([&](const Field& row) {
    const std::string scene = row["scene"].text();
    const Field without = row["without"], error = row["error"], work = row["work"], judged = row["judged"];
    const bool is_given = without.is_nothing();
    const std::string part = is_given ? "nothing" : without.text();
    ++(is_given ? scenes : runs);
    if (error.is_nothing()) {
      grid.rows.push_back({{scene, part, "–", "–", "–", "–", "–", "–", "–", "–", row["refused"].text()}, "warn"});
      return;
    }
    const std::optional<double> of_given = row["of_given"].number_or_null(), rms = error["rms_h"].number_or_null();
    std::string else_ = error["same_components"].flag() ? "" : "the tissue falls into other parts";
    std::string mark;
    if (is_given) {
      const bool holds = judged["topology_holds"].flag();
      const std::optional<double> step = judged["step_max_h"].number_or_null();
      else_ = fmt::format("beside the reference: step {} h, topology {}", figure_text(step), holds ? "holds" : "fails");
      if (!holds) {
        sheet.holds = false;
        mark = "bad";
      }
      for (const Stage stage : kStages) {
        const std::string name(name_of(stage));
        const Field one = row["stages"][name.c_str()];
        stages.rows.push_back({{scene, name, figure_text(one["seconds_per_frame"].number_or_null(), 1e3),
                                fmt::format("{} of {}", one["frames"].count(), row["frames"].count())}});
      }
      if (!work.is_nothing()) {
        std::vector<std::string> cells = {scene};
        for (const char* number : {"carried", "held", "resolved", "loose", "groups"}) {
          cells.push_back(figure_text(work[number].number_or_null()));
        }
        const Field cost = row["per_resolved"];
        cells.push_back(cost.is_nothing() ? "–"
                                          : fmt::format("{} ± {}", figure_text(cost["seconds"].number_or_null(), 1e9),
                                                        figure_text(cost["standard_error"].number_or_null(), 1e9)));
        each.rows.push_back({cells});
      }
    } else {
      if (rms && *rms > kFarthest) {
        ++beyond;
      } else {
        curve_named(chart, part, Look::dots).dots.push_back({of_given, rms, fmt::format("{} without {}", scene, part)});
      }
    }
    grid.rows.push_back({{scene, part, ms_text(row["seconds_per_frame"]), ms_text(row["seconds_per_frame"], "min"),
                          ms_text(row["seconds_per_frame"], "max"), figure_text(of_given), figure_text(rms),
                          figure_text(error["max_h"].number_or_null()), whole(error["removed_otherwise"].count()),
                          work.is_nothing() ? "–" : figure_text(work["resolved"].number_or_null()), else_},
                         mark});
  });
  if (beyond > 0) chart.words += fmt::format(" Not drawn, because beyond {} h: {}.", kFarthest, whole(beyond));
  sheet.summary = fmt::format("What each part of {} {} costs: {} runs without one.", whole(scenes),
                              scenes == 1 ? "scene" : "scenes", whole(runs));
  sheet.pieces.emplace_back(std::move(chart));
  sheet.pieces.emplace_back(std::move(grid));
  sheet.pieces.emplace_back(std::move(stages));
  if (!each.rows.empty()) sheet.pieces.emplace_back(std::move(each));
}

// --- campaigns

void campaigns_pieces(Sheet& sheet, const Field& document) {
  constexpr const char* kParts[] = {"generating", "simulating", "reference", "judging", "waiting"};
  Stack stack = {"Where the time of a case goes",
                 "Time of all threads. Simulating is what they wait for a device, too; reference: its stages, with "
                 "which the backend's are compared.",
                 "ms",
                 {},
                 {}};
  for (const char* const part : kParts) stack.parts.push_back({part, {}});
  Grid grid;
  grid.title = "Campaigns";
  grid.words =
      "What was compared meanwhile stands beside each rate: verdicts, positions after a step beside the reference's "
      "and "
      "the greatest distance of one, and what stayed undecided within rounding.";
  grid.columns = {
      {"campaign"},         {"backend"},         {"devices", true},   {"particles", true},    {"bodies a load", true},
      {"threads", true},    {"cases", true},     {"cases/s", true},   {"of reference", true}, {"verdicts", true},
      {"violations", true}, {"undecided", true}, {"positions", true}, {"greatest [h]", true}};
  document["rows"].each([&](const Field& row) {
    const int64_t cases = row["cases"].count();
    const std::string name = row["campaign"].text(), backend = row["backend"].text();
    stack.labels.push_back(name + ", " + backend);
    for (std::size_t k = 0; k < std::size(kParts); ++k) {
      const std::optional<double> seconds = row["thread_seconds"][kParts[k]].number_or_null();
      stack.parts[k].values.push_back(cases > 0 ? times(seconds, 1e3 / static_cast<double>(cases)) : std::nullopt);
    }
    const Field error = row["error"];
    const int64_t violations = error["violations"].count();
    if (violations > 0) sheet.holds = false;
    grid.rows.push_back(
        {{name, backend, whole(static_cast<int64_t>(row["devices"].length())),
          figure_text(row["mean_particles"].number_or_null()), whole(row["batch"].count()),
          whole(row["threads"].count()), whole(cases), figure_text(row["cases_per_second"].number_or_null()),
          figure_text(row["of_reference"].number_or_null()), whole(error["verdicts"].count()), whole(violations),
          whole(error["undecided"].count()), error["positions"].is_nothing() ? "–" : whole(error["positions"].count()),
          figure_text(error["greatest_h"].number_or_null())},
         violations > 0 ? "bad" : ""});
  });
  sheet.summary = "Cases that random campaigns judge in a second, on " + document["processor"].text() + ".";
  sheet.pieces.emplace_back(std::move(stack));
  sheet.pieces.emplace_back(std::move(grid));
}

struct Suite {
  const char *name, *rows;
  void (*add)(Sheet& sheet, const Field& document);
};
constexpr Suite kSuites[] = {
    {"stages", "rows", stages_pieces},           {"sampling", "rows", sampling_pieces},
    {"clusters", "rows", clusters_pieces},       {"scale", "rows", scale_pieces},
    {"rotations", "methods", rotations_pieces},  {"machine_limits", "rows", machine_limits_pieces},
    {"solver", "scenes", solver_pieces},         {"baselines", "rows", baselines_pieces},
    {"sensitivity", "rows", sensitivity_pieces}, {"parts", "rows", parts_pieces},
    {"campaigns", "rows", campaigns_pieces}};

}  // namespace

Sheet bench_sheet(const Field& document) {
  const Field named = document["suite"];
  const std::string name = named.text();
  for (const Suite& suite : kSuites) {
    if (name != suite.name) continue;
    Sheet sheet;
    sheet.kind = "benchmark";
    sheet.title = name;
    add_measurement(sheet, document);
    if (document[suite.rows].length() == 0) sheet.holds = false;
    suite.add(sheet, document);
    if (document[suite.rows].length() == 0) {
      sheet.summary = "Nothing was measured.";
      sheet.pieces.clear();
    }
    // What is worse than the document says is said as it is.
    if (sheet.holds && !*sheet.holds && sheet.badge != "✕ incomplete") sheet.badge = "✕ fails";
    return sheet;
  }
  std::string known;
  for (const Suite& suite : kSuites) known += (known.empty() ? "" : ", ") + std::string(suite.name);
  named.refuse("'" + name + "' is no suite that a page is made of; these are: " + known + ", tune");
}

}  // namespace cutproof::report
