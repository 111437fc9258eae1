// The columns of each suite of `bench`, said once: the table on the terminal and the tables of a page are made of them.
#pragma once
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "report/document_fields.h"

namespace cutproof::report {

// A terminal has 80 columns, and says other things above its table.
enum class Shown { everywhere, page, terminal };

// What stands above it, with the unit in brackets, and in it of a row's fields.
struct RowColumn {
  using Text = std::function<std::string(const Field& row)>;  // an empty text is nothing
  std::string head;
  std::variant<std::string, Text> cell;  // as io::filled has it, or made
  Shown shown = Shown::everywhere;
};
using RowColumns = std::vector<RowColumn>;

// Of a suite of `bench`.
struct Suite {
  const char *name, *rows;  // of the list that must not be empty
  RowColumns (*columns)();
  void (*add)(Sheet& sheet, const Field& document);  // to a page
};
extern const Suite kStagesSuite, kSamplingSuite, kClustersSuite, kScaleSuite, kRotationsSuite, kMachineLimitsSuite,
    kSolverSuite, kBaselinesSuite, kSensitivitySuite, kPartsSuite, kCampaignsSuite, kMaterialSuite;

inline constexpr const Suite* kSuites[] = {&kStagesSuite,      &kSamplingSuite,      &kClustersSuite,  &kScaleSuite,
                                           &kRotationsSuite,   &kMachineLimitsSuite, &kSolverSuite,    &kBaselinesSuite,
                                           &kSensitivitySuite, &kPartsSuite,         &kCampaignsSuite, &kMaterialSuite};

// Table 3, in the document of the suite `baselines`.
extern const Suite kMethodsOfBaselines;

// On the terminal a figure is written as its format says, and nothing is "-".
std::string terminal_text(const RowColumn& column, const nlohmann::json& row);

// On a page a figure with a format has four digits, one without is a count, and nothing is "–". Columns without words
// are columns of numbers.
Grid grid_of(std::string title, std::string words, const RowColumns& columns, int filter = -1);
void add_row(Grid& grid, const RowColumns& columns, const Field& row, const std::string& kind = {});

}  // namespace cutproof::report
