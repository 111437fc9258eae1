#include "report/documents.h"

#include <algorithm>

#include "model/counted.h"
#include "model/io/columns.h"
#include "report/document_fields.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

// Documents of cutproof within something that is none: how many, and where the first one is.
struct Within {
  int64_t count = 0;
  std::string first;
};
void look_within(const json& given, const std::string& path, int depth, Within& found) {
  if (given.is_object() && given.contains("format") && given["format"].is_string() &&
      given["format"].get_ref<const std::string&>().starts_with("cutproof.")) {
    if (found.count++ == 0) found.first = path;
    return;
  }
  if (depth == 0) return;
  for (const auto& each : given.items()) {
    const std::string inner = given.is_array() ? fmt::format("{}[{}]", path, each.key())
                              : path.empty()   ? each.key()
                                               : path + "." + each.key();
    if (each.value().is_structured()) look_within(each.value(), inner, depth - 1, found);
  }
}

[[noreturn]] void refuse_without_format(const json& given, const std::string& file) {
  constexpr int kDepth = 3;
  Within within;
  look_within(given, "", kDepth, within);
  if (within.count == 0)
    throw InputError(file, "format", "this is missing, so no command of cutproof has written the file",
                     kDocumentRemedy);
  throw InputError(
      file, "format",
      fmt::format("this is missing; the file holds {} within another, the first as '{}'",
                  counted(static_cast<std::size_t>(within.count), "document of cutproof", "documents of cutproof"),
                  within.first),
      "write what it holds to files of their own, and give those");
}

// The program writes one version of each format, and reads no other.
void require_version(const Field& document, DocumentKind kind) {
  constexpr int64_t kFuzzVersion = 4, kJudgeVersion = 1, kBenchVersion = 3;
  const int64_t known = kind == DocumentKind::fuzz    ? kFuzzVersion
                        : kind == DocumentKind::judge ? kJudgeVersion
                                                      : kBenchVersion;
  const Field field = document["format_version"];
  const int64_t version = field.count();
  if (version == known) return;
  throw InputError(document.file, field.path, fmt::format("this is version {}, and only {} is read", version, known),
                   "run the command that has written it again, with this version of cutproof");
}

}  // namespace

DocumentKind kind_of(const json& given, const std::string& file) {
  const Field document = {&given, file, "", kDocumentRemedy};
  if (!given.is_object()) document.refuse("this is no result of cutproof");
  // A counterexample may be the line of a case alone.
  if (!given.contains("format") && given.contains("nodes")) return DocumentKind::counterexample;
  if (!given.contains("format")) refuse_without_format(given, file);
  const std::string format = document["format"].text();
  if (format == "cutproof.run" || format == "cutproof.check") return DocumentKind::run;
  if (format == "cutproof.fuzz") return DocumentKind::fuzz;
  if (format == "cutproof.judge") return DocumentKind::judge;
  if (format == "cutproof.counterexample") return DocumentKind::counterexample;
  // That a suite is missing is said by the reader of benchmarks.
  if (format == "cutproof.bench")
    return document["suite"].text_or("") == "tune" ? DocumentKind::tune : DocumentKind::bench;
  document["format"].refuse("'" + format + "' is nothing that a page is made of");
}

Sheet sheet_of(const json& given, const std::string& file, const std::string& failure) {
  const DocumentKind kind = kind_of(given, file);
  const Field document = {&given, file, "", kDocumentRemedy};
  if (kind == DocumentKind::run || kind == DocumentKind::counterexample)
    document["format"].refuse("this is no campaign and no measurement");
  require_version(document, kind);
  return kind == DocumentKind::fuzz    ? campaign_sheet(document, failure)
         : kind == DocumentKind::judge ? judge_sheet(document)
         : kind == DocumentKind::bench ? bench_sheet(document)
                                       : tune_sheet(document);
}

std::vector<std::pair<std::string, const json*>> dissections_in(const json& document) {
  std::vector<std::pair<std::string, const json*>> found;
  for (const char* const name : {"dissections", "moving_dissections"}) {
    if (const auto one = document.find(name); one != document.end()) found.emplace_back(name, &*one);
  }
  return found;
}

std::optional<double> seconds_of(const Field& times, const char* which) {
  if (times.is_nothing()) return std::nullopt;
  return times[which].number_or_null();
}

Curve front_of(const std::vector<Dot>& dots, const std::string& name) {
  std::vector<Dot> sorted;
  for (const Dot& dot : dots) {
    if (dot.x && dot.y) sorted.push_back(dot);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Dot& a, const Dot& b) { return std::pair(*a.x, *a.y) < std::pair(*b.x, *b.y); });
  Curve front = {name, Look::front, {}};
  for (const Dot& dot : sorted) {
    if (front.dots.empty() || *dot.y < *front.dots.back().y) front.dots.push_back(dot);
  }
  return front;
}

void add_tolerance(Chart& chart, const std::vector<Dot>& dots, double tolerance) {
  std::optional<double> low, high;
  for (const Dot& dot : dots) {
    if (!dot.x) continue;
    low = std::min(low.value_or(*dot.x), *dot.x);
    high = std::max(high.value_or(*dot.x), *dot.x);
  }
  if (!low) return;
  const std::string text = fmt::format("tolerance, {:.4g} h", tolerance);
  chart.curves.push_back({"tolerance", Look::level, {{low, tolerance, text}, {high, tolerance, text}}});
}

PropertyTable property_table(const Field& properties) {
  struct Read {
    int rank;
    double of_bound;
    GridRow row;
  };
  std::vector<Read> all;
  PropertyTable table;
  properties.each([&](const Field& one) {
    const int64_t judged = one["judged"].count(), failed = one["failed"].count(), checked = one["checked"].count();
    const int64_t inconclusive = one["inconclusive"].count();
    const std::optional<double> of_bound = one["of_bound"].number_or_null(),
                                measured = one["measured"].number_or_null();
    const std::string given_unit = one["unit"].text_or(""), unit = given_unit == "1" ? "" : " " + given_unit;
    const bool fails = failed > 0, looked = judged > 0;
    table.failing += fails;
    table.judged += looked || fails;
    table.inconclusive += inconclusive;
    const std::string result = fails ? "fails" : looked ? "holds" : "nothing to look at";
    const std::string doubt = inconclusive > 0
                                  ? fmt::format("{} of {}", io::grouped(inconclusive), io::grouped(checked))
                                  : std::string("none");
    all.push_back({fails    ? 0
                   : looked ? 1
                            : 2,
                   of_bound.value_or(-1),
                   {{one["property"].text(), one["stage"].is_nothing() ? "–" : one["stage"].text(), result,
                     io::grouped(judged), io::grouped(failed), looked || fails ? figure_text(measured) + unit : "–",
                     looked && of_bound ? fmt::format("{:.2g}", *of_bound) : "–", looked ? doubt : "–"},
                    fails                 ? "bad"
                    : looked && !of_bound ? "exact"
                                          : ""}});
  });
  std::stable_sort(all.begin(), all.end(), [](const Read& a, const Read& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.of_bound > b.of_bound;
  });
  table.grid.title = "Every property";
  table.grid.words =
      "What fails comes first, then what comes nearest to its bound. “Inconclusive within rounding” counts comparisons "
      "too close to rounding to tell; they count as right.";
  table.grid.columns = {{"property"},
                        {"after"},
                        {"result"},
                        {"verdicts", true},
                        {"failed", true},
                        {"greatest measured", true},
                        {"of its bound", true},
                        {"inconclusive within rounding", true}};
  table.grid.filter = 2;
  for (Read& one : all) table.grid.rows.push_back(std::move(one.row));
  return table;
}

void add_measurement(Sheet& sheet, const Field& document) {
  const bool is_complete = document["complete"].flag();
  const Field holds = document["holds"];
  if (holds.is_there()) sheet.holds = holds.flag();
  if (!is_complete) sheet.holds = false;
  sheet.badge = !is_complete ? "incomplete" : !sheet.holds ? "measured" : *sheet.holds ? "holds" : "fails";
  sheet.facts.push_back("backend " + document["backend"].text());
  sheet.again = document["again"].text_or("");
  // "2026-11-27T19:56:01Z" as pages write it.
  std::string date = document["date"].text();
  if (date.size() == 20 && date[10] == 'T') date = date.substr(0, 10) + " " + date.substr(11, 5) + " UTC";
  sheet.made = {document["cutproof"].text(), sheet.again, date, document["device"].text(),
                document["commit"].text_or("")};
  if (!is_complete)
    sheet.notes.push_back("The measurement was stopped before its end: this is what there was by then.");
}

}  // namespace cutproof::report
