// Campaigns: `cutproof fuzz`, and `cutproof judge`.
#include <algorithm>

#include "model/io/columns.h"
#include "model/left_stages.h"
#include "property_tests/coverage_classes.h"
#include "report/document_fields.h"

namespace cutproof::report {

namespace {

std::string cases_in_words(int64_t count) {
  return fmt::format("{} {}", io::grouped(count), count == 1 ? "case" : "cases");
}

bool occurs_at_rest(const std::string& name) {
  return std::any_of(property_tests::kCoverageClasses.begin(), property_tests::kCoverageClasses.end(),
                     [&](const auto& one) { return one.name == name && one.occurs == property_tests::Occurs::always; });
}

void add_coverage(Sheet& sheet, const Field& document, bool moves) {
  const Field coverage = document["coverage"];
  if (!coverage.there().is_object()) coverage.refuse("this is no object");
  Grid grid;
  grid.title = "What occurred in the cases";
  grid.words = moves ? "Coverage classes: a class that never occurred has not been tested."
                     : "Coverage classes: a class that never occurred has not been tested. Classes of moving bodies "
                       "(--dynamics) are left out.";
  grid.columns = {{"class"}, {"cases", true}};
  std::string absent;
  for (const auto& each : coverage.value->items()) {
    const std::string name = each.key();  // clang captures no binding
    const nlohmann::json& value = each.value();
    const int64_t count = Field{&value, coverage.file, coverage.path + "." + name, coverage.remedy}.count();
    if (count == 0 && !moves && !occurs_at_rest(name)) continue;
    grid.rows.push_back({{name, io::grouped(count)}, count == 0 ? "warn" : ""});
    if (count == 0) absent += (absent.empty() ? "" : ", ") + name;
    if (name == "uncoupled without promise" && count > 0) {
      sheet.notes.push_back(
          fmt::format("Not promised: in {} connected tissue lost its coupling. The rules of those scenes allow it, so "
                      "it is counted and not judged.",
                      cases_in_words(count)));
    }
  }
  if (!absent.empty()) sheet.notes.push_back("Never occurred, so untested: " + absent + ".");
  std::stable_sort(grid.rows.begin(), grid.rows.end(),
                   [](const GridRow& a, const GridRow& b) { return a.kind > b.kind; });
  sheet.pieces.emplace_back(std::move(grid));
}

// A row for each kind of question, with the worst case of it.
Grid kinds_of(const Field& operation) {
  Grid grid;
  grid.title = "Kinds of " + operation["operation"].text();
  grid.words = "The worst case of a kind is one that fails, or the one that came nearest to its bound.";
  grid.columns = {{"kind"},           {operation["of"].text(), true},
                  {"wrong", true},    {"worst in"},
                  {"measured", true}, {"bound", true},
                  {"question", true}};
  operation["kinds"].each([&](const Field& kind) {
    const int64_t failed = kind["failed"].count();
    GridRow row{{kind["kind"].text(), io::grouped(kind["cases"].count()), io::grouped(failed)},
                failed > 0 ? "bad" : ""};
    const Field worst = kind["worst"];
    if (worst.is_nothing()) {
      row.cells.insert(row.cells.end(), 4, "–");
    } else {
      const Field size = worst["size"];
      for (const std::string& cell :
           {worst["property"].text(), figure_text(worst["measured"].number_or_null()),
            figure_text(worst["bound"].number_or_null()),
            size.is_there() ? "of size " + io::grouped(size.count()) : io::grouped(worst["index"].count())}) {
        row.cells.push_back(cell);
      }
    }
    grid.rows.push_back(std::move(row));
  });
  return grid;
}

}  // namespace

Sheet campaign_sheet(const Field& document, const std::string& failure) {
  Sheet sheet;
  sheet.kind = "campaign";
  const std::string backend = document["backend"].text();
  const bool moves = document["dynamics"].flag();
  const bool is_complete = document["complete"].flag();
  const int64_t cases = document["cases"].count(), verdicts = document["verdicts"].count();
  const int64_t refused = document["refused"].count();
  PropertyTable properties = property_table(document["properties"]);
  const Field violations = document["violations"];
  violations.each([&](const Field& one) {
    Card card;
    card.title = one["property"].text() + " after " + one["stage"].text();
    // Of the case that its counterexample shows.
    const Field simplified = one["shrunk"];
    if (simplified.is_there()) card.words = simplified["witness"].text_or("");
    if (card.words.empty()) card.words = one["witness"].text_or("");
    if (card.words.empty()) card.words = one["text"].text();
    card.facts = {{"Case", io::grouped(one["index"].count())}, {"Counterexample", one["file"].text()}};
    if (const Field drawn = one["drawn"]; drawn.is_there()) {
      const auto size = [](const Field& of) {
        const int64_t particles = of["particles"].count(), strokes = of["strokes"].count();
        return fmt::format("{} {} and {} {}", io::grouped(particles), particles == 1 ? "particle" : "particles",
                           io::grouped(strokes), strokes == 1 ? "stroke" : "strokes");
      };
      card.facts.emplace_back(
          "Simplification",
          simplified.is_there()
              ? fmt::format("from {} to {}", size(drawn), size(simplified))
              : fmt::format("none: of {}, it fails only with the other bodies of its load", size(drawn)));
      if (simplified.is_there()) card.facts.emplace_back("As it was drawn", one["text"].text());
    }
    if (sheet.cards.size() < kMostCards) {
      sheet.cards.push_back(std::move(card));
    } else {
      ++sheet.cards_left_out;
    }
  });
  const std::size_t wrong = violations.length();
  sheet.title = "backend " + backend;
  // Nothing holds because its document says so.
  sheet.holds = document["holds"].flag() && wrong == 0 && properties.failing == 0 && properties.judged > 0 &&
                verdicts > 0 && is_complete && failure.empty();
  sheet.badge = *sheet.holds ? "holds" : wrong == 0 && !is_complete ? "incomplete" : "fails";
  const std::string subject =
      fmt::format("cutproof tried {} random dissections{} on backend {}, {:.3g} particles on average",
                  io::grouped(cases), moves ? " of moving bodies" : "", backend, document["mean_particles"].number());
  if (wrong > 0) {
    sheet.summary = fmt::format("{}: {} of them {} a property.", subject, io::grouped(static_cast<long long>(wrong)),
                                wrong == 1 ? "violates" : "violate");
  } else if (*sheet.holds) {
    sheet.summary = fmt::format("{}: none violates any property, in {} verdicts.", subject, io::grouped(verdicts));
  } else {
    sheet.summary = fmt::format("{}: no violation was found, and it does not hold all the same: {}.", subject,
                                !failure.empty() ? failure
                                : verdicts == 0  ? std::string("nothing was judged")
                                : !is_complete   ? std::string("it was stopped before its end")
                                                 : std::string("a property fails"));
  }
  if (wrong > 0 && !failure.empty()) sheet.notes.push_back("As a whole: " + failure + ".");
  sheet.facts.push_back(fmt::format("seed {}", document["seed"].seed()));
  const Field sizes = document["sizes"];
  if (sizes.length() != 2) sizes.refuse("these are not two sizes");
  sheet.facts.push_back(fmt::format("sizes {}-{}", sizes.at(0).count(), sizes.at(1).count()));
  sheet.facts.push_back(fmt::format("{} verdicts", io::grouped(verdicts)));
  sheet.facts.push_back(fmt::format("{:.3g} s", document["seconds"].number()));
  if (const Field merged = document["merged_shards"]; merged.is_there())
    sheet.facts.push_back(fmt::format("put together from {} shards", merged.count()));
  else if (document["shards"].count() > 1)
    sheet.facts.push_back(fmt::format("shard {} of {}", document["shard"].count(), document["shards"].count()));
  if (document["commit"].is_there()) sheet.facts.push_back("commit " + document["commit"].text());
  sheet.facts.push_back("cutproof " + document["cutproof"].text());
  if (const Field left = document["left_to_reference"]; left.length() > 0)
    sheet.notes.push_back(left_in_words(left.texts()));
  if (refused > 0)
    sheet.notes.push_back(fmt::format("The backend refused {}: nothing is known of them.", cases_in_words(refused)));
  if (properties.inconclusive > 0)
    sheet.notes.push_back(
        fmt::format("Inconclusive within rounding: {} comparisons were too close to rounding to tell. They "
                    "count as right; the table names their properties.",
                    io::grouped(properties.inconclusive)));
  if (const Field steps = document["steps_compared"]; steps.is_there())
    sheet.notes.push_back(fmt::format(
        "{} steps were compared with the reference's: {} positions at most {} h apart, and {} that rounding may carry "
        "farther.",
        io::grouped(steps["steps"].count()), io::grouped(steps["particles"].count()),
        figure_text(steps["greatest_h"].number()), io::grouped(steps["not_compared"].count())));
  sheet.pieces.emplace_back(std::move(properties.grid));
  add_coverage(sheet, document, moves);
  return sheet;
}

Sheet judge_sheet(const Field& document) {
  Sheet sheet;
  sheet.kind = "judged plugin";
  const Field plugin = document["plugin"];
  const std::string name = plugin["name"].text(), version = plugin["version"].text();
  const std::string library = plugin["library"].is_nothing() ? "" : plugin["library"].text();
  sheet.title = name.empty() ? (library.empty() ? "a plugin" : library) : name + (version.empty() ? "" : " " + version);
  const bool is_complete = document["complete"].flag();
  Grid operations;
  operations.title = "Operations";
  operations.words = "A question is one call of the plugin; a case is a matrix or a body within it.";
  operations.columns = {{"operation"},         {"result"},        {"cases", true},        {"of"},
                        {"questions", true},   {"refused", true}, {"not answered", true}, {"failed", true},
                        {"wrong cases", true}, {"seconds", true}};
  std::vector<Piece> tables;
  int64_t failing = 0, judged = 0;
  bool all_hold = true;
  document["operations"].each([&](const Field& one) {
    const std::string operation = one["operation"].text();
    const int64_t questions = one["questions"].count(), refused = one["refused"].count(),
                  failed = one["failed"].count();
    const std::string untested = questions <= refused ? "every question was refused" : one["untested"].text_or("");
    PropertyTable properties = property_table(one["properties"]);
    const std::size_t failures = one["failures"].length();
    const bool holds =
        one["holds"].flag() && failed == 0 && failures == 0 && properties.failing == 0 && untested.empty();
    const bool is_whole = one["complete"].flag();
    all_hold = all_hold && holds;
    failing += !holds;
    ++judged;
    operations.rows.push_back({{operation,
                                !holds     ? "fails"
                                : is_whole ? "holds"
                                           : "holds as far as it went",
                                io::grouped(one["cases"].count()), one["of"].text(), io::grouped(questions),
                                io::grouped(refused), io::grouped(one["not_answered"].count()), io::grouped(failed),
                                io::grouped(one["failed_cases"].count()), figure_text(one["seconds"].number())},
                               holds ? "" : "bad"});
    if (!untested.empty()) sheet.notes.push_back(operation + ": too little was judged: " + untested + ".");
    if (one["ended"].flag())
      sheet.notes.push_back(operation +
                            ": the plugin's process ended and could not be started again; nothing more was asked.");
    else if (one["gave_up"].flag())
      sheet.notes.push_back(operation + ": given up after too many questions without an answer; --keep-going goes on.");
    one["not_asked"].each([&](const Field& question) {
      sheet.notes.push_back(fmt::format("{}: “{}” of size {} was not asked: of size {} its answer took {:.2g} s.",
                                        operation, question["kind"].text(), io::grouped(question["size"].count()),
                                        io::grouped(question["size_before"].count()), question["seconds"].number()));
    });
    one["unpromised"].each([&](const Field& property) {
      const int64_t would_fail = property["failing"].count();
      sheet.notes.push_back(fmt::format(
          "{}: '{}' is not promised, so it was not judged{}.", operation, property["property"].text(),
          would_fail > 0 ? fmt::format("; it would have failed in {} questions", io::grouped(would_fail)) : ""));
    });
    one["failures"].each([&](const Field& failure) {
      Card card;
      card.title = operation + ": " + failure["property"].text();
      card.words = failure["text"].text();
      const std::string given_unit = failure["unit"].text(), unit = given_unit == "1" ? "" : " " + given_unit;
      const Field drawn = failure["drawn_size"];
      const std::string which =
          drawn.is_there() ? "of size " + io::grouped(drawn.count()) : io::grouped(failure["index"].count());
      const std::string simplified = failure["shrunk"].text();  // what is said already is not said again
      card.facts = {{"Question", fmt::format("{} ({})", which, failure["kind"].text())},
                    {"Shrunk to", failure["size"].text() + (simplified == card.words ? "" : ": " + simplified)},
                    {"Measured / bound", fmt::format("{:.4g}{} / {:.4g}{}", failure["measured"].number(), unit,
                                                     failure["bound"].number(), unit)},
                    {"Saved as", failure["file"].text_or("")}};
      card.command = failure["again"].text_or("");
      if (sheet.cards.size() < kMostCards) {
        sheet.cards.push_back(std::move(card));
      } else {
        ++sheet.cards_left_out;
      }
    });
    properties.grid.title = "Properties of " + operation;
    properties.grid.columns[3].head = one["of"].text();
    tables.emplace_back(std::move(properties.grid));
    tables.emplace_back(kinds_of(one));
  });
  for (const char* const stages : {"dissections", "moving_dissections"}) {
    const Field one = document[stages];
    if (!one.is_there()) continue;
    ++judged;
    all_hold = all_hold && one["holds"].flag();
    failing += !one["holds"].flag();
  }
  sheet.holds = document["holds"].flag() && all_hold && judged > 0 && is_complete;
  sheet.badge = *sheet.holds ? "holds" : failing == 0 && !is_complete ? "incomplete" : "fails";
  const std::string what = library.empty() ? sheet.title : fmt::format("{} ({})", sheet.title, library);
  sheet.summary =
      *sheet.holds ? fmt::format("cutproof judged the kernels of {}: everything that was judged holds.", what)
      : failing == 1 && judged == 1
          ? fmt::format("cutproof judged the kernels of {}: the one operation that was judged fails.", what)
      : failing > 0 ? fmt::format("cutproof judged the kernels of {}: {} of {} operations {}.", what, failing, judged,
                                  failing == 1 ? "fails" : "fail")
      : !is_complete
          ? fmt::format("cutproof judged the kernels of {}; it was stopped before its end, and so it does not hold.",
                        what)
          : fmt::format("cutproof judged the kernels of {}; it does not hold: nothing was judged.", what);
  sheet.facts = {plugin["precision"].text() + " precision", "on " + plugin["device"].text(),
                 fmt::format("seed {}", document["seed"].seed()), "cutproof " + document["cutproof"].text()};
  sheet.again = document["again"].text_or("");
  if (!operations.rows.empty()) sheet.pieces.emplace_back(std::move(operations));
  for (Piece& table : tables) sheet.pieces.push_back(std::move(table));
  return sheet;
}

}  // namespace cutproof::report
