// What pages of suites that time whole scenes share: stages, sampling, scale.
#pragma once
#include <set>

#include "report/suites/suites.h"

namespace cutproof::report {

// What sets one row apart from another of the same scene, where rows differ in it.
class Variants {
 public:
  explicit Variants(const Field& rows);
  std::string of(const Field& row) const;
  // The name of a row's scene, with that.
  std::string scene_of(const Field& row) const;
  // Columns of a page, with that name before them.
  RowColumns named(RowColumns columns) const;

 private:
  static constexpr const char* kNames[] = {"cooking", "acceleration", "remove"};
  std::set<std::string> seen_[std::size(kNames)];
};
std::string with(const std::string& name, const std::string& variant);
std::string solver_text(const Field& row);

// Kidneys that a document has timed, beside Table 3 of the paper: those of about as many particles as it has.
// `is_asked`: the document is about the paper's sizes, so that none of them was measured is said as well.
void add_table_3(Sheet& sheet, const Field& document, bool is_asked);

// A part for each stage, one above the other; shown without those that never ran.
Stack stage_stack();
void show_stack(Sheet& sheet, Stack&& stack);

// Medians over particles, by x in the end.
Chart over_particles(const std::string& title, const std::string& words);
void sort_by_x(Chart& chart);

// Of sampling and scale, whose rows have all stages each: columns, with the suite's own beside the times.
RowColumns scene_columns(const RowColumns& beside_times);

// What their pages have in common.
class TimedScenes {
 public:
  TimedScenes(const Field& document, const RowColumns& columns);
  void add(const Field& row);
  void show_stack(Sheet& sheet);
  // In the end: Table 3, and the table of all rows.
  void show_tables(Sheet& sheet, const Field& document, bool is_asked);

  const Variants variants;

 private:
  const RowColumns columns_;
  Stack stack_ = stage_stack();
  Grid grid_;
  bool holds_ = true;
};

}  // namespace cutproof::report
