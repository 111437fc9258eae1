// What a page shows of campaigns and measurements, and what of their documents is refused.
#include "report/documents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "model/error.h"
#include "model/io/filled.h"
#include "report/assets.h"
#include "report/document_page.h"
#include "report/suites/columns.h"

namespace cutproof::report::documents_test {
namespace {

using nlohmann::json;

json property(const std::string& name, int64_t failed, int64_t inconclusive = 0, int64_t judged = 3) {
  return {{"property", name},
          {"stage", "split"},
          {"unit", "h"},
          {"judged", judged},
          {"checked", 9 * judged},
          {"failed", failed},
          {"inconclusive", inconclusive},
          {"measured", 2.0},
          {"of_bound", 0.5}};
}

json campaign(const std::vector<json>& properties, const std::vector<json>& violations = {}) {
  return {{"format", "cutproof.fuzz"},
          {"format_version", 4},
          {"cutproof", "1"},
          {"backend", "host"},
          {"dynamics", false},
          {"complete", true},
          {"cases", 1000},
          {"verdicts", 12345},
          {"refused", 0},
          {"mean_particles", 20.0},
          {"seed", 7},
          {"sizes", {0, 79}},
          {"seconds", 1.0},
          {"shard", 1},
          {"shards", 1},
          {"properties", properties},
          {"violations", violations},
          {"left_to_reference", json::array()},
          {"holds", violations.empty()},
          {"coverage", {{"boxes", 40}, {"uncoupled without promise", 3}, {"cavity", 0}, {"wall", 0}}}};
}

const Grid& grid_of(const Sheet& sheet, std::size_t k) { return std::get<Grid>(sheet.pieces.at(k)); }

TEST(ACampaign, WithoutViolationSaysSoPlainly) {
  const Sheet sheet = sheet_of(campaign({property("coverage", 0, 2), property("cap", 0, 0, 0)}), "f");
  EXPECT_EQ(sheet.holds, true);
  EXPECT_EQ(sheet.badge, "holds");
  EXPECT_NE(sheet.summary.find("none violates any property, in 12,345 verdicts"), std::string::npos) << sheet.summary;
  EXPECT_TRUE(sheet.cards.empty());
  const Grid& properties = grid_of(sheet, 0);
  EXPECT_EQ(properties.rows.at(0).cells.at(7), "2 of 27") << "what is inconclusive within rounding is said";
  EXPECT_EQ(properties.rows.at(1).cells.at(2), "nothing to look at");
  EXPECT_NE(sheet.notes.at(0).find("2 comparisons"), std::string::npos);
}

// What was not met comes first; what needs bodies that move is not asked of others.
TEST(ACampaign, ListsEachClassThatItsCasesShouldHaveMet) {
  json document = campaign({property("coverage", 0)});
  const auto classes = [&] {
    std::vector<std::string> names;
    const Sheet sheet = sheet_of(document, "f");
    for (const GridRow& row : grid_of(sheet, 1).rows) names.push_back(row.cells.at(0));
    return names;
  };
  EXPECT_EQ(classes(), (std::vector<std::string>{"cavity", "boxes", "uncoupled without promise"}));
  document["dynamics"] = true;
  EXPECT_EQ(classes(), (std::vector<std::string>{"cavity", "wall", "boxes", "uncoupled without promise"}));
}

TEST(ACampaign, SaysWhichStagesWereLeftToTheReference) {
  json split = campaign({property("exactness", 0)});
  const std::size_t notes = sheet_of(split, "f").notes.size();
  split["left_to_reference"] = {"step", "skin"};
  const Sheet sheet = sheet_of(split, "f");
  ASSERT_EQ(sheet.notes.size(), notes + 1);
  EXPECT_EQ(sheet.notes.front(), "The reference ran step and skin for the backend: not judged.");
}

// A page may not call good what its document only claims to be.
TEST(ACampaign, DoesNotHoldBecauseItsDocumentSaysSo) {
  const json good = campaign({property("coverage", 0)});
  ASSERT_EQ(sheet_of(good, "f").holds, true);
  EXPECT_EQ(sheet_of(good, "f", "no case had: merge").holds, false) << "what a conclusion says counts";
  json bad = campaign({property("coverage", 2)});
  EXPECT_EQ(sheet_of(bad, "f").holds, false) << "a property fails";
  bad = campaign({property("coverage", 0, 0, 0)});
  EXPECT_EQ(sheet_of(bad, "f").holds, false) << "nothing was looked at";
  bad = good;
  bad["complete"] = false;
  EXPECT_EQ(sheet_of(bad, "f").holds, false);
  EXPECT_EQ(sheet_of(bad, "f").badge, "incomplete");
  bad = good;
  bad["verdicts"] = 0;
  EXPECT_EQ(sheet_of(bad, "f").holds, false);
  bad = campaign({property("coverage", 0)},
                 {{{"index", 3}, {"property", "p"}, {"stage", "split"}, {"text", "t"}, {"file", "a"}}});
  bad["holds"] = true;
  EXPECT_EQ(sheet_of(bad, "f").holds, false);
}

TEST(ACampaign, HasACardForEachViolationWithWhatRemainsOfItsCase) {
  const json violation = {{"index", 41},
                          {"property", "coverage"},
                          {"stage", "split"},
                          {"text", "all of it"},
                          {"witness", "here"},
                          {"file", "a.json"},
                          {"drawn", {{"particles", 812}, {"strokes", 5}}},
                          {"shrunk", {{"particles", 3}, {"strokes", 1}}}};
  const Sheet sheet = sheet_of(campaign({property("coverage", 1)}, {violation}), "f");
  ASSERT_EQ(sheet.cards.size(), 1u);
  EXPECT_EQ(sheet.cards[0].title, "coverage after split");
  EXPECT_EQ(sheet.cards[0].words, "here");
  EXPECT_EQ(sheet.cards[0].facts.at(2).second, "from 812 particles and 5 strokes to 3 particles and 1 stroke");
  json simpler = violation;
  simpler["shrunk"]["witness"] = "there";
  EXPECT_EQ(sheet_of(campaign({property("coverage", 1)}, {simpler}), "f").cards.at(0).words, "there")
      << "the counterexample shows the shrunk case";
  EXPECT_EQ(grid_of(sheet, 0).rows.at(0).kind, "bad") << "what fails comes first";
}

json times(double ms) { return {{"median", 1e-3 * ms}, {"min", 1e-3 * ms}, {"max", 1e-3 * ms}}; }
json bench(const std::string& suite) {
  return {{"format", "cutproof.bench"}, {"format_version", 3}, {"cutproof", "1"}, {"backend", "host"},
          {"device", "a CPU"},          {"date", "today"},     {"suite", suite},  {"complete", true}};
}
json trial(int iterations, double rms, std::optional<double> ms, const std::string& outcome) {
  return {{"substeps", 2},
          {"iterations", iterations},
          {"acceleration", "none"},
          {"differences", ""},
          {"outcome", outcome},
          {"why", ""},
          {"rms_h", rms},
          {"max_h", 2 * rms},
          {"rms_h_by_frame", {0.0, rms}},
          {"removed_otherwise", 0},
          {"seconds_per_frame", ms ? times(*ms) : json(nullptr)}};
}
json tuning(const json& found) {
  json document = bench("tune");
  document.update({{"scene", "scenes/liver.json"},
                   {"tolerance_h", 0.1},
                   {"reference", nullptr},
                   {"left", json::array()},
                   {"front", json::array()},
                   {"found", found},
                   {"trials",
                    {trial(8, 0.01, 8.0, "within"), trial(4, 0.05, 4.0, "within"), trial(6, 0.06, 6.0, "within"),
                     trial(1, 0.4, 1.0, "over"), trial(2, 0.2, std::nullopt, "over")}}});
  return document;
}

TEST(AMeasurement, SaysWhenAndWhereItWasMadeAndByWhichCommand) {
  json document = tuning(nullptr);
  document.update({{"date", "2026-11-27T19:56:01Z"}, {"again", "cutproof tune it"}, {"commit", "0123456789ab"}});
  const Sheet sheet = sheet_of(document, "f");
  ASSERT_TRUE(sheet.made);
  EXPECT_EQ(to_json(*sheet.made), (json{{"program", "1"},
                                        {"command", "cutproof tune it"},
                                        {"date", "2026-11-27 19:56 UTC"},
                                        {"machine", "a CPU"},
                                        {"commit", "0123456789ab"}}));
}

TEST(ATuning, ShowsAllThatWasTriedItsFrontAndTheAnswer) {
  const json found = {{"trial", 1},
                      {"verified", trial(4, 0.05, std::nullopt, "within")},
                      {"verdicts", 77},
                      {"seconds_per_frame", times(4)},
                      {"times_cheaper", 2.0}};
  const Sheet sheet = sheet_of(tuning(found), "f");
  EXPECT_EQ(sheet.title, "liver");
  EXPECT_EQ(sheet.badge, "found");
  EXPECT_NE(sheet.summary.find("2 × 4, none: 4 ms a frame, 2.00 times cheaper than as given"), std::string::npos)
      << sheet.summary;
  const Chart& chart = std::get<Chart>(sheet.pieces.at(0));
  EXPECT_EQ(chart.x.unit, "ms");
  EXPECT_EQ(chart.y.unit, "h");
  const auto curve = [&](const std::string& name) {
    for (const Curve& one : chart.curves) {
      if (one.name == name) return one;
    }
    ADD_FAILURE() << "no curve " << name;
    return Curve();
  };
  std::vector<double> front;
  for (const Dot& dot : curve("the best").dots) front.push_back(*dot.x);
  EXPECT_EQ(front, (std::vector<double>{1, 4, 8})) << "6 ms are beaten in both, and who has no time is nowhere";
  EXPECT_EQ(curve("the answer").dots.at(0).text, "2 × 4, none");
  EXPECT_EQ(curve("tolerance").dots.at(0).y, 0.1);
  EXPECT_EQ(grid_of(sheet, 2).rows.size(), 5u);
  EXPECT_EQ(grid_of(sheet, 2).rows.at(1).kind, "good");
  EXPECT_EQ(sheet_of(tuning(nullptr), "f").holds, false);
}

json stage_row(const std::string& what, double ms, const json& paper) {
  return {
      {"scene", "kidney"},  {"what", what},           {"particles", 100},     {"substeps", 4}, {"iterations", 4},
      {"cooking", "boxes"}, {"acceleration", "none"}, {"frames", 3},          {"of", 3},       {"seconds", times(ms)},
      {"limit", nullptr},   {"paper_seconds", paper}, {"error_text", "equal"}};
}

TEST(ABenchmark, OfStagesStacksThemAndHasThePapersFiguresBesideOurs) {
  json document = bench("stages");
  document.update(
      {{"holds", true},
       {"scenes", json::array()},
       {"rows", {stage_row("frame", 5, 0.05975), stage_row("step", 3, 0.04), stage_row("split", 1, nullptr)}}});
  const Sheet sheet = sheet_of(document, "f");
  const Stack& stack = std::get<Stack>(sheet.pieces.at(0));
  ASSERT_EQ(stack.parts.size(), 2u) << "stages that did not run have no part, nor has the frame";
  EXPECT_EQ(stack.parts[0].values.at(0), 3.0);
  const Grid& table = grid_of(sheet, 1);
  EXPECT_EQ(table.rows.at(0).cells.back(), "5");
  EXPECT_EQ(table.rows.at(1).cells.back(), "59.75");
  EXPECT_EQ(table.rows.at(1).kind, "paper");
}

json campaign_row(const std::string& backend, const json& of_reference, int violations) {
  return {{"campaign", "moving"},
          {"backend", backend},
          {"devices", {"a device", "another"}},
          {"sizes", {0, 79}},
          {"dynamics", true},
          {"threads", 8},
          {"batch", 1024},
          {"loads_at_once", 6},
          {"cases", 2000},
          {"mean_particles", 47.0},
          {"seconds", 2.0},
          {"cases_per_second", 1000.0},
          {"of_reference", of_reference},
          {"thread_seconds",
           {{"generating", 1.0}, {"simulating", 4.0}, {"reference", 2.0}, {"judging", 8.0}, {"waiting", 1.0}}},
          {"error",
           {{"verdicts", 600000},
            {"violations", violations},
            {"refused", 0},
            {"checked", 20000000},
            {"inconclusive", 12},
            {"positions", of_reference.is_null() ? json(nullptr) : json(900000)},
            {"greatest_h", of_reference.is_null() ? json(nullptr) : json(2e-5)}}}};
}

TEST(ABenchmark, OfCampaignsHasWhereACasesTimeGoesAndWhatWasCompared) {
  json document = bench("campaigns");
  document.update({{"holds", true},
                   {"processor", "a processor, 8 threads"},
                   {"rows", {campaign_row("reference", nullptr, 0), campaign_row("gpu", 0.5, 0)}}});
  const Sheet sheet = sheet_of(document, "f");
  EXPECT_EQ(sheet.holds, true);
  EXPECT_NE(sheet.summary.find("a processor, 8 threads"), std::string::npos) << sheet.summary;
  const Stack& stack = std::get<Stack>(sheet.pieces.at(0));
  EXPECT_EQ(stack.labels, (std::vector<std::string>{"moving, reference", "moving, gpu"}));
  ASSERT_EQ(stack.parts.size(), 5u);
  EXPECT_EQ(stack.parts[3].name, "judging");
  EXPECT_EQ(stack.parts[3].values.at(1), 4.0) << "8 s of threads for 2,000 cases are 4 ms";
  const Grid& table = grid_of(sheet, 1);
  ASSERT_EQ(table.rows.size(), 2u);
  for (const GridRow& row : table.rows) EXPECT_EQ(row.cells.size(), table.columns.size());
  EXPECT_EQ(table.rows[0].cells.back(), "–") << "the reference is not compared with itself";
  EXPECT_EQ(table.rows[1].cells.at(2), "2");
  document["rows"][1]["error"]["violations"] = 1;
  EXPECT_EQ(sheet_of(document, "f").holds, false);
}

TEST(ABenchmark, ThatMeasuredNothingOrWasStoppedDoesNotHold) {
  json document = bench("machine_limits");
  document.update({{"holds", true}, {"rows", json::array()}});
  EXPECT_EQ(sheet_of(document, "f").holds, false);
  document["rows"] = {{{"what", "copy"}, {"seconds", times(1)}, {"bytes_per_second", 1e9}, {"lost", 0}}};
  EXPECT_EQ(sheet_of(document, "f").holds, true);
  document["rows"][0]["lost"] = 4;
  EXPECT_EQ(sheet_of(document, "f").holds, false) << "bytes that were lost, whatever the document says of itself";
  document["rows"][0]["lost"] = 0;
  document["complete"] = false;
  EXPECT_EQ(sheet_of(document, "f").holds, false);
}

// One description, two places: what stands in it is the same figure, as each of them writes it.
TEST(AColumn, IsWrittenAsATerminalAndAsAPageDoes) {
  const RowColumns columns = {{"name", "{name}"},
                              {"count", "{count}"},
                              {"median [ms]", "{1e3*seconds/median:.1f}"},
                              {"here", "{count}", Shown::page},
                              {"there", "{count} of {count}", Shown::terminal},
                              {"holds", "{holds}"},
                              {"made", [](const Field& row) { return row["holds"].flag() ? "so" : std::string(); }}};
  json row = {{"name", "a"}, {"count", 12345}, {"seconds", {{"median", 0.0123456}}}, {"holds", true}};
  const auto on_page = [&] {
    Grid grid = grid_of("", "", columns);
    const std::string file = "f";
    add_row(grid, columns, Field{&row, file, "rows[0]", "remedy"});
    return grid;
  };
  const auto on_terminal = [&] {
    std::vector<std::string> cells;
    for (const RowColumn& column : columns) cells.push_back(terminal_text(column, row));
    return cells;
  };
  using Cells = std::vector<std::string>;
  EXPECT_EQ(on_page().rows.at(0).cells, (Cells{"a", "12,345", "12.35", "12,345", "yes", "so"}));
  EXPECT_EQ(on_terminal(), (Cells{"a", "12345", "12.3", "12345", "12345 of 12345", "yes", "so"}));
  std::vector<bool> numbers;
  for (const Column& column : on_page().columns) numbers.push_back(column.is_number);
  EXPECT_EQ(numbers, (std::vector<bool>{false, true, true, true, false, false}));
  row["seconds"] = nullptr;
  row["holds"] = false;
  EXPECT_EQ(on_page().rows.at(0).cells, (Cells{"a", "12,345", "–", "12,345", "no", "–"}));
  EXPECT_EQ(on_terminal().at(2), "-");
  EXPECT_EQ(on_terminal().at(6), "-");
  row["count"] = -1;
  row["seconds"] = 3;
  try {
    on_page();
    ADD_FAILURE() << "a count below 0 was read";
  } catch (const InputError& error) {
    EXPECT_EQ(error.field(), "rows[0].count");
  }
  row.erase("count");
  EXPECT_THROW(on_page(), InputError) << "a count that is missing";
}

TEST(AColumn, IsOfFieldsThatArePartOfTheFormat) {
  const auto schema = [](const std::string& name) {
    std::ifstream file(CUTPROOF_SOURCE "/docs/reference/schemas/" + name + ".json");
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::string common = schema("common") + schema("errors");
  int named = 0;
  for (const Suite* const suite : kSuites) {
    const std::string own = schema(std::string("bench_") + suite->name), all = own + common;
    EXPECT_NE(own, "") << suite->name;
    for (const RowColumn& column : suite->columns()) {
      const auto* const text = std::get_if<std::string>(&column.cell);
      if (!text) continue;
      io::filled(*text, [&](const std::string& path, double, const std::string&) {
        std::istringstream names(path);
        for (std::string name; std::getline(names, name, '/'); ++named)
          EXPECT_NE(all.find("\"" + name + "\": {"), std::string::npos)
              << suite->name << ", " << column.head << ": " << name;
        return std::string();
      });
    }
  }
  EXPECT_GT(named, 100);
}

// --- Table 3

json sampling_row(int64_t particles, const json& paper, double ms) {
  json row = stage_row("", ms, nullptr);
  row.erase("what");
  row["scene"] = "kidney_" + std::to_string(paper.at("particles").get<int64_t>());
  row.update({{"particles", particles},
              {"clusters", 311},
              {"seconds",
               {{"frame", times(ms)},
                {"step", times(ms)},
                {"detect", nullptr},
                {"split", nullptr},
                {"merge", nullptr},
                {"expand", nullptr},
                {"skin", nullptr}}},
              {"error", {{"step", nullptr}, {"frame", nullptr}}},
              {"frame_to_first", 1.0},
              {"paper", paper}});
  return row;
}
json table_2(int64_t particles, double ms) {
  return {{"particles", particles}, {"clusters", 301}, {"frame_seconds", 1e-3 * ms}, {"frame_to_first", 1.0}};
}
json sampling(const std::vector<json>& rows) {
  json document = bench("sampling");
  document.update({{"holds", true}, {"scaled_down", 1}, {"rows", rows}});
  return document;
}
const Grid* grid_named(const Sheet& sheet, const std::string& title) {
  for (const Piece& piece : sheet.pieces) {
    const Grid* const grid = std::get_if<Grid>(&piece);
    if (grid && grid->title == title) return grid;
  }
  return nullptr;
}
constexpr const char* kTable3 = "Table 3 of the paper, beside ours";

TEST(ABenchmark, OfKidneysHasTable3OfThePaperBesideOurs) {
  const json only_table_3 = {
      {"particles", 12800}, {"clusters", nullptr}, {"frame_seconds", 0.0202}, {"frame_to_first", nullptr}};
  json small = sampling_row(12790, only_table_3, 0.4);
  small["frame_to_first"] = nullptr;
  const Sheet sheet = sheet_of(sampling({sampling_row(37724, table_2(37704, 42.05), 0.59),
                                         sampling_row(101056, table_2(101096, 59.75), 0.85), small}),
                               "f");
  const Grid* const table = grid_named(sheet, kTable3);
  ASSERT_NE(table, nullptr);
  ASSERT_EQ(table->rows.size(), 4u);
  const std::vector<std::string> first = {"12,800", "22.1", "70.2", "13.6", "22.4", "20.2", "0.4", "12,790"};
  EXPECT_TRUE(std::equal(first.begin(), first.end(), table->rows[0].cells.begin())) << table->rows[0].cells.at(6);
  const std::vector<std::string> last = {"101,096", "105.7", "2038.6", "56.2", "70.2", "59.8", "0.85", "101,056"};
  EXPECT_TRUE(std::equal(last.begin(), last.end(), table->rows[3].cells.begin())) << table->rows[3].cells.at(6);
  // What was not measured is said, and no figure stands for it.
  const std::vector<std::string> none = {
      "48,385", "64.4", "601.1", "46.0", "52.0", "47.0", "–", "–", "not measured in this document"};
  EXPECT_EQ(table->rows[2].cells, none);
  EXPECT_NE(table->words.find("Not measured in this document: kidneys of about 48,385 particles"), std::string::npos);
  EXPECT_NE(table->words.find("RTX 2060"), std::string::npos) << "the paper's device";
  EXPECT_NE(table->words.find("another machine: a CPU"), std::string::npos) << "and ours: " << table->words;
  for (const Column& column : table->columns) EXPECT_EQ(column.head.find("×"), std::string::npos) << "no ratio";
  // The size that Table 2 does not have is in Table 3 alone.
  const Grid* const other = grid_named(sheet, "Table 2 of the paper, beside ours");
  ASSERT_NE(other, nullptr);
  EXPECT_EQ(other->rows.size(), 2u);
}

TEST(ABenchmark, OfOtherSizesHasNoTable3UnlessItIsAboutThem) {
  json small = sampling({sampling_row(2359, table_2(37704, 42.05), 3.7)});
  small["scaled_down"] = 16;
  const Grid* const said = grid_named(sheet_of(small, "f"), kTable3);
  ASSERT_NE(said, nullptr);
  EXPECT_NE(said->words.find("12,800, 37,704, 48,385, 101,096"), std::string::npos) << said->words;
  EXPECT_EQ(said->words.find("Ours are"), std::string::npos) << "there are none: " << said->words;
  json document = bench("stages");
  document.update({{"holds", true}, {"scenes", json::array()}, {"rows", {stage_row("frame", 5, nullptr)}}});
  EXPECT_EQ(grid_named(sheet_of(document, "f"), kTable3), nullptr);
  // Stages of a kidney of such a size have it; another body of as many particles has not.
  document["rows"][0]["particles"] = 101011;
  ASSERT_NE(grid_named(sheet_of(document, "f"), kTable3), nullptr);
  document["rows"][0]["scene"] = "box_101011";
  EXPECT_EQ(grid_named(sheet_of(document, "f"), kTable3), nullptr);
}

bool has_note(const Sheet& sheet, const std::string& words) {
  return std::any_of(sheet.notes.begin(), sheet.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

// Kinds with the worst case of each, and what was not asked.
TEST(ADocumentOfJudge, ShowsEveryKindWithItsWorstCase) {
  const json worst = {{"property", "best rotation"},
                      {"index", 7},
                      {"measured", 0.5},
                      {"bound", 1e-6},
                      {"unit", "1"},
                      {"holds", false},
                      {"text", "far off"}};
  json large = worst;
  large["size"] = 65'537;
  const auto kind = [](const char* name, int64_t failed, const json& of) -> json {
    return {{"kind", name},     {"questions", 2}, {"cases", 512},       {"refused", 0},
            {"failed", failed}, {"worst", of},    {"first_failure", of}};
  };
  const json operation = {
      {"operation", "rotations"},
      {"cases", 1536},
      {"of", "matrices"},
      {"questions", 6},
      {"refused", 0},
      {"not_answered", 0},
      {"not_asked", {{{"kind", "many"}, {"size", 1'000'000}, {"size_before", 65'537}, {"seconds", 2.0}}}},
      {"failed", 2},
      {"failed_cases", 300},
      {"complete", true},
      {"gave_up", false},
      {"ended", false},
      {"seconds", 1.0},
      {"holds", false},
      {"unpromised", json::array()},
      {"failures", json::array()},
      {"properties", {property("best rotation", 300)}},
      {"kinds", {kind("any", 44, worst), kind("many", 256, large), kind("right", 0, nullptr)}}};
  const json document = {
      {"format", "cutproof.judge"},
      {"format_version", 1},
      {"cutproof", "1"},
      {"seed", 1},
      {"holds", false},
      {"complete", true},
      {"operations", {operation}},
      {"plugin", {{"library", "a.so"}, {"name", ""}, {"version", ""}, {"precision", "single"}, {"device", "cpu"}}}};
  const Sheet sheet = sheet_of(document, "f");
  EXPECT_TRUE(has_note(sheet, "“many” of size 1,000,000 was not asked"));
  const Grid& properties = grid_of(sheet, 1);
  EXPECT_EQ(properties.columns.at(3).head, "matrices");
  const Grid& kinds = grid_of(sheet, 2);
  ASSERT_EQ(kinds.rows.size(), 3u);
  EXPECT_EQ(kinds.rows[0].cells, (std::vector<std::string>{"any", "512", "44", "best rotation", "0.5", "1e-06", "7"}));
  EXPECT_EQ(kinds.rows[0].kind, "bad");
  EXPECT_EQ(kinds.rows[1].cells.at(6), "of size 65,537");
  EXPECT_EQ(kinds.rows[2].cells.at(3), "–");
  EXPECT_EQ(kinds.rows[2].kind, "");
}

TEST(ADocument, WithoutAFormatIsRefusedByWhatItHolds) {
  const auto said = [](const json& document) {
    try {
      kind_of(document, "f.json");
    } catch (const InputError& error) {
      EXPECT_EQ(error.field(), "format");
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(said({{"steps", json::array()}}).find("no command of cutproof has written the file"), std::string::npos);
  const std::string collection = said({{"runs", {{{"a", 1}}, bench("stages"), bench("stages")}}});
  EXPECT_NE(collection.find("holds 2 documents of cutproof within another, the first as 'runs[1]'"), std::string::npos)
      << collection;
  EXPECT_NE(collection.find("files of their own"), std::string::npos) << collection;
}

TEST(ADocument, OfAnotherVersionIsRefused) {
  const json judged = {{"format", "cutproof.judge"}, {"format_version", 1}};
  for (const auto& [document, known] :
       {std::pair{campaign({}), 4}, {judged, 1}, {bench("stages"), 3}, {bench("tune"), 3}}) {
    for (int64_t version = 0; version <= known + 1; ++version) {
      if (version == known) continue;
      json other = document;
      other["format_version"] = version;
      try {
        sheet_of(other, "f.json");
        ADD_FAILURE() << document.at("format") << " " << version << " was read";
      } catch (const InputError& error) {
        EXPECT_EQ(error.file(), "f.json");
        EXPECT_EQ(error.field(), "format_version");
        const std::string said = error.what();
        EXPECT_NE(said.find("this is version " + std::to_string(version)), std::string::npos) << said;
        EXPECT_NE(said.find("only " + std::to_string(known) + " is read"), std::string::npos) << said;
        EXPECT_NE(said.find("remedy"), std::string::npos) << said;
      }
    }
  }
}

TEST(ADocument, ThatLacksAFieldIsRefusedByItsName) {
  const json good = campaign({property("coverage", 0)});
  for (const char* const field : {"properties", "refused", "complete", "left_to_reference", "coverage"}) {
    json lacking = good;
    lacking.erase(field);
    try {
      sheet_of(lacking, "f.json");
      ADD_FAILURE() << "shown without " << field;
    } catch (const InputError& error) {
      EXPECT_EQ(error.field(), field);
    }
  }
}

TEST(ADocument, ThatIsNoneIsRefusedByFieldWithARemedy) {
  const json good = campaign({property("coverage", 0)});
  const auto refused = [](json bad, const std::string& pointer, const json& value, const std::string& field) {
    bad[json::json_pointer(pointer)] = value;
    try {
      sheet_of(bad, "f.json");
      ADD_FAILURE() << pointer << " was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "f.json");
      EXPECT_EQ(error.field(), field);
      EXPECT_NE(std::string(error.what()).find("remedy"), std::string::npos) << error.what();
    }
  };
  refused(good, "/format", "cutproof.mesh", "format");
  refused(good, "/cases", -1, "cases");
  refused(good, "/seed", -1, "seed");
  refused(good, "/sizes", {1}, "sizes");
  refused(good, "/properties/0/failed", "many", "properties[0].failed");
  refused(good, "/violations", {{{"index", 0}, {"property", "p"}}}, "violations[0].stage");
  refused(good, "/coverage/boxes", 1.5, "coverage.boxes");
  refused(tuning(nullptr), "/trials/0/outcome", "lucky", "trials[0].outcome");
  refused(tuning(nullptr), "/found", {{"trial", 5}}, "found.trial");
  refused(bench("stages"), "/suite", "nonsense", "suite");
}

TEST(DocumentPages, HoldNamesAsTextOnly) {
  if (kPageScript.empty()) GTEST_SKIP() << "this build has no report pages";
  constexpr const char* kHostile = "</script><script>window.hacked=1</script>";
  json document =
      campaign({property(kHostile, 1)},
               {{{"index", 3}, {"property", kHostile}, {"stage", "split"}, {"text", "@DATA@"}, {"file", kHostile}}});
  document["backend"] = kHostile;
  const std::string text = document_page({sheet_of(document, "f")}, {}, {"1"});
  EXPECT_EQ(text.find("<script>window"), std::string::npos);
  const std::string begin = "id=\"data\">";
  const std::size_t first = text.find(begin) + begin.size();
  const json data = json::parse(text.substr(first, text.find("</script>", first) - first));
  EXPECT_EQ(data.at("sheets").at(0).at("cards").at(0).at("title"), std::string(kHostile) + " after split");
  EXPECT_EQ(data.at("sheets").at(0).at("cards").at(0).at("words"), "@DATA@") << "what it holds is no mark";
}

}  // namespace
}  // namespace cutproof::report::documents_test
