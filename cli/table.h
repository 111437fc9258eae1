// Tables on the terminal.
#pragma once
#include <initializer_list>
#include <string>
#include <vector>

#include "benchmarks/times.h"

namespace cutproof::cli {

// Columns as wide as what stands in them; the first is flush left, the others flush right.
class Table {
 public:
  explicit Table(std::vector<std::string> head) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// Lists one after the other: a table's row from its parts.
std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> parts);

// Milliseconds of the median; "-" if nothing was measured.
std::string ms(const benchmarks::Times& times);

}  // namespace cutproof::cli
