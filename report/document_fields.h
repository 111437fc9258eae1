// Shared by the readers of documents.
#pragma once
#include <fmt/format.h>

#include <string>

#include "report/field.h"
#include "report/sheet.h"

namespace cutproof::report {

inline constexpr const char* kDocumentRemedy =
    "give what `cutproof fuzz`, `judge`, `bench` or `tune` has written with --json";

Sheet campaign_sheet(const Field& document, const std::string& failure);
Sheet judge_sheet(const Field& document);
Sheet bench_sheet(const Field& document);
Sheet tune_sheet(const Field& document);

// The table of properties that campaigns have, those that fail first; and how many pairs of a property and a stage
// fail, and how many looked at something.
struct PropertyTable {
  Grid grid;
  int64_t failing = 0, judged = 0, inconclusive = 0;
};
PropertyTable property_table(const Field& properties);

// Of "times": its median, least and greatest [s]; nothing where it is null.
std::optional<double> seconds_of(const Field& times, const char* which = "median");

// Of the points of least x and y: those that no other beats in one without being beaten in the other, by x.
Curve front_of(const std::vector<Dot>& dots, const std::string& name);

// Draws a tolerance [h] across the points that have an x; nothing if none has.
void add_tolerance(Chart& chart, const std::vector<Dot>& dots, double tolerance);

// What every benchmark and tuning begins with: badge, facts, the command to repeat it.
void add_measurement(Sheet& sheet, const Field& document);

}  // namespace cutproof::report
