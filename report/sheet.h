// What a page shows of a document that is no run: words, cards, plots and tables. Everything is said here; the page
// itself only draws (report/page/documents.js).
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "report/html.h"
#include "report/results.h"

namespace cutproof::report {

struct Axis {
  std::string name, unit;  // the unit is empty for counts
  bool is_logarithmic = false;
};
// Where x or y is nothing, it is in the table below the plot alone.
struct Dot {
  std::optional<double> x, y;
  std::string text;  // which configuration this is, in words
};
// Without dots: level, a limit or a goal, is a dashed line; front, which no dot beats in both, a thin one.
enum class Look { dots, joined, level, front };
struct Curve {
  std::string name;
  Look look = Look::dots;
  std::vector<Dot> dots;
};
struct Chart {
  std::string title, words;
  Axis x, y;
  std::vector<Curve> curves;
};

// Stacked bars, one for each label.
struct Stack {
  std::string title, words, unit;
  std::vector<std::string> labels;
  std::vector<Series> parts;  // a value for each label
};

struct Column {
  std::string head;
  bool is_number = false;
};
struct GridRow {
  std::vector<std::string> cells;
  std::string kind = {};  // good, bad, warn, paper; exact: it holds, and has no margin; empty: as any other
};
struct Grid {
  std::string title, words;
  std::vector<Column> columns;
  std::vector<GridRow> rows;
  int filter = -1;  // by which column rows may be filtered
};

using Piece = std::variant<Chart, Stack, Grid>;

// A failure.
struct Card {
  std::string title, words;
  std::vector<std::pair<std::string, std::string>> facts;  // what, and its value
  std::string command;                                     // shows it again
  int picture = -1;                                        // number of the Scenery beside it; -1: none
};

struct Sheet {
  std::string kind;            // "campaign", "benchmark", ...: what this is
  std::string title, summary;  // the summary in a sentence or two
  std::optional<bool> holds;   // nothing: it judges nothing
  std::string badge;           // the same in a word or two
  std::vector<std::string> facts, notes;
  std::string again;         // the command that repeats it; empty: it is not known
  std::optional<Made> made;  // how what it shows was measured; nothing: when the page was made
  std::vector<Card> cards;
  int64_t cards_left_out = 0;
  std::vector<Piece> pieces;
};
inline constexpr std::size_t kMostCards = 200;
inline constexpr std::size_t kMostRows = 5000;  // of a table, and dots of a plot; what is beyond is said to be left out

nlohmann::json to_json(const Sheet& sheet);

// "0.0123", four digits; "–" for nothing. `times`: 1e3 of seconds gives milliseconds.
std::string figure_text(const std::optional<double>& value, double times = 1);

}  // namespace cutproof::report
