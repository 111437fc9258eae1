#include "cli/table.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/io/filled.h"

namespace cutproof::cli {

namespace {

// Of UTF-8, none of whose characters here is wider than one column.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (const std::vector<std::string>& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], width_of(row[k]));
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string padding(widths[k] - width_of(row[k]), ' ');
      line += (k == 0 ? "  " + row[k] + padding : "  " + padding + row[k]);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

Column::Column(std::string above, const std::string& text)
    : Column(std::move(above), [text](const nlohmann::json& row) { return io::filled(text, row); }) {}

std::string table_of(const nlohmann::json& rows, const std::vector<Column>& columns) {
  std::vector<std::string> head;
  for (const Column& column : columns) head.push_back(column.head);
  Table table(head);
  for (const nlohmann::json& row : rows) {
    std::vector<std::string> cells;
    for (const Column& column : columns) cells.push_back(column.cell(row));
    table.add(cells);
  }
  return table.text();
}

}  // namespace cutproof::cli
