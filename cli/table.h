// Tables on the terminal.
#pragma once
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/io/columns.h"

namespace cutproof::cli {

// Columns as wide as what stands in them; the first is flush left, the others flush right. What is too wide for the
// screen is made narrower, each of these only if the one before does not do:
// - heads over several lines,
// - sentences (cells of several words) over several lines, flush left,
// - one space between columns instead of two,
// - parts one below the other, each with the columns that name a row.
class Table {
 public:
  Table() = default;
  explicit Table(std::vector<std::string> head) : has_head_(true) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  // `names`: how many of the first columns name a row.
  std::string text(std::size_t names = 1, std::size_t columns = io::kColumns) const;

 private:
  std::vector<std::vector<std::string>> rows_;
  bool has_head_ = false;
};

// A column of a table of rows from a document: what stands above it, and in it, of a row's fields.
struct Column {
  using Cell = std::function<std::string(const nlohmann::json& row)>;
  std::string head;
  Cell cell;
  Column(std::string above, Cell text) : head(std::move(above)), cell(std::move(text)) {}
  // `text`: see io::filled.
  Column(std::string above, const std::string& text);
};
// `names`: see Table::text.
std::string table_of(const nlohmann::json& rows, const std::vector<Column>& columns, std::size_t names = 1);

}  // namespace cutproof::cli
