#include "report/sheet.h"

#include <fmt/format.h>

#include "model/io/columns.h"
#include "model/io/json_number.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

json to_json(const Axis& axis) {
  return {{"name", axis.name}, {"unit", axis.unit}, {"logarithmic", axis.is_logarithmic}};
}

std::string left_out(std::size_t count, const char* what) {
  if (count <= kMostRows) return {};
  return fmt::format("{} of {} {} are shown, the others are in the document.", io::grouped(kMostRows),
                     io::grouped(static_cast<long long>(count)), what);
}

json to_json(const Chart& chart) {
  json curves = json::array();
  std::size_t count = 0;
  for (const Curve& curve : chart.curves) {
    json dots = json::array();
    for (const Dot& dot : curve.dots) {
      if (++count > kMostRows) continue;
      dots.push_back({json_number(dot.x), json_number(dot.y), dot.text});
    }
    constexpr const char* kLooks[] = {"dots", "joined", "level", "front"};
    const char* const look = kLooks[static_cast<std::size_t>(curve.look)];
    curves.push_back({{"name", curve.name}, {"look", look}, {"dots", std::move(dots)}});
  }
  return {{"kind", "chart"},
          {"title", chart.title},
          {"words", chart.words},
          {"x", to_json(chart.x)},
          {"y", to_json(chart.y)},
          {"curves", std::move(curves)},
          {"leftOut", left_out(count, "points")}};
}

json to_json(const Stack& stack) {
  json parts = json::array();
  for (const Series& part : stack.parts) {
    json values = json::array();
    for (const std::optional<double>& value : part.values) values.push_back(json_number(value));
    parts.push_back({{"name", part.name}, {"values", std::move(values)}});
  }
  return {{"kind", "stack"},    {"title", stack.title},   {"words", stack.words},
          {"unit", stack.unit}, {"labels", stack.labels}, {"parts", std::move(parts)}};
}

json to_json(const Grid& grid) {
  json columns = json::array(), rows = json::array();
  for (const Column& column : grid.columns) columns.push_back({column.head, column.is_number});
  for (std::size_t k = 0; k < std::min(grid.rows.size(), kMostRows); ++k)
    rows.push_back({{"cells", grid.rows[k].cells}, {"kind", grid.rows[k].kind}});
  return {{"kind", "grid"},
          {"title", grid.title},
          {"words", grid.words},
          {"columns", std::move(columns)},
          {"rows", std::move(rows)},
          {"filter", grid.filter},
          {"leftOut", left_out(grid.rows.size(), "rows")}};
}

}  // namespace

json to_json(const Sheet& sheet) {
  json cards = json::array(), pieces = json::array();
  for (const Card& card : sheet.cards) {
    json facts = json::array();
    for (const auto& [what, value] : card.facts) facts.push_back({what, value});
    cards.push_back({{"title", card.title},
                     {"words", card.words},
                     {"facts", std::move(facts)},
                     {"command", card.command},
                     {"picture", card.picture}});
  }
  for (const Piece& piece : sheet.pieces)
    pieces.push_back(std::visit([](const auto& one) { return to_json(one); }, piece));
  return {{"kind", sheet.kind},
          {"title", sheet.title},
          {"summary", sheet.summary},
          {"holds", sheet.holds ? json(*sheet.holds) : json(nullptr)},
          {"badge", sheet.badge},
          {"facts", sheet.facts},
          {"notes", sheet.notes},
          {"again", sheet.again},
          {"made", sheet.made ? report::to_json(*sheet.made) : json()},
          {"cards", std::move(cards)},
          {"cardsLeftOut", sheet.cards_left_out},
          {"pieces", std::move(pieces)}};
}

std::string figure_text(const std::optional<double>& value, double times) {
  return value ? fmt::format("{:.4g}", times * *value) : "–";
}

}  // namespace cutproof::report
