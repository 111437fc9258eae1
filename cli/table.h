// Tables on the terminal.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cutproof::cli {

// Columns as wide as what stands in them; the first is flush left, the others flush right.
class Table {
 public:
  Table() = default;
  explicit Table(std::vector<std::string> head) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
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
std::string table_of(const nlohmann::json& rows, const std::vector<Column>& columns);

}  // namespace cutproof::cli
