#include "report/suites/columns.h"

#include <sstream>

#include "model/io/columns.h"
#include "model/io/filled.h"

namespace cutproof::report {

namespace {

constexpr const char* kAbsent = "–";

std::string on_a_page(const std::string& text, const Field& row) {
  return io::filled(text, [&](const std::string& path, double factor, const std::string& format) -> std::string {
    const nlohmann::json* value = row.value;
    std::string where = row.path;
    std::istringstream names(path);
    for (std::string name; value && !value->is_null() && std::getline(names, name, '/');) {
      const Field inner = Field{value, row.file, where, row.remedy}[name.c_str()];
      value = inner.value;
      where = inner.path;
    }
    const Field field = {value, row.file, where, row.remedy};
    if (!format.empty()) return figure_text(field.number_or_null(), factor);
    if (field.there().is_null()) return kAbsent;
    if (value->is_boolean()) return *value ? "yes" : "no";
    return value->is_string() ? field.text() : io::grouped(field.count());
  });
}

bool is_number(const std::string& cell) {
  return cell.empty() || cell == kAbsent || cell.find_first_of("0123456789") == (cell.front() == '-' ? 1U : 0U);
}

}  // namespace

std::string terminal_text(const RowColumn& column, const nlohmann::json& row) {
  if (const auto* const fields = std::get_if<std::string>(&column.cell)) return io::filled(*fields, row);
  static const std::string kNoFile;
  const std::string text = std::get<RowColumn::Text>(column.cell)({&row, kNoFile, "", kDocumentRemedy});
  return text.empty() ? "-" : text;
}

Grid grid_of(std::string title, std::string words, const RowColumns& columns, int filter) {
  Grid grid = {std::move(title), std::move(words), {}, {}, filter};
  for (const RowColumn& column : columns) {
    if (column.shown != Shown::terminal) grid.columns.push_back({column.head, true});
  }
  return grid;
}

void add_row(Grid& grid, const RowColumns& columns, const Field& row, const std::string& kind) {
  GridRow made = {{}, kind};
  for (const RowColumn& column : columns) {
    if (column.shown == Shown::terminal) continue;
    const auto* const made_of = std::get_if<RowColumn::Text>(&column.cell);
    std::string cell = made_of ? (*made_of)(row) : on_a_page(std::get<std::string>(column.cell), row);
    if (made_of && cell.empty()) cell = kAbsent;
    Column& above = grid.columns[made.cells.size()];
    above.is_number = above.is_number && is_number(cell);
    made.cells.push_back(std::move(cell));
  }
  grid.rows.push_back(std::move(made));
}

}  // namespace cutproof::report
