#include "cli/table.h"

#include <gtest/gtest.h>

namespace table_test {
namespace {

TEST(Table, HasColumnsAsWideAsWhatStandsInThem) {
  cutproof::cli::Table table({"", "‖RᵀR‖", "ms"});
  table.add({"jacobi4", "1", "10.25"});
  table.add({"x", "1234567", ""});
  EXPECT_EQ(table.text(),
            "             ‖RᵀR‖     ms\n"
            "  jacobi4        1  10.25\n"
            "  x        1234567\n");
}

TEST(Table, IsMadeOfTheFieldsOfADocument) {
  const nlohmann::json rows = {{{"name", "a"}, {"seconds", {{"median", 0.00125}}}, {"lost", nullptr}, {"of", 3}},
                               {{"name", "b"}, {"seconds", nullptr}, {"lost", "inf"}, {"of", 12}}};
  const auto doubled = [](const nlohmann::json& row) { return std::to_string(2 * row.at("of").get<int>()); };
  EXPECT_EQ(
      cutproof::cli::table_of(
          rows,
          {{"", "{name}"}, {"ms", "{1e3*seconds/median:.2f}"}, {"lost", "{lost:.1e} of {of}"}, {"twice", doubled}}),
      "       ms       lost  twice\n"
      "  a  1.25     - of 3      6\n"
      "  b     -  inf of 12     24\n");
}

TEST(Table, BreaksHeadsAndThenSentencesThatAreTooWide) {
  cutproof::cli::Table table({"", "median ms", "error"});
  table.add({"step", "1.5", "3 of 20 removals differ, and one more"});
  EXPECT_EQ(table.text(1, 42),
            "        median\n"
            "            ms  error\n"
            "  step     1.5  3 of 20 removals differ,\n"
            "                and one more\n");
}

// Each part has the columns that name a row, and is no wider than it may be.
TEST(Table, FallsIntoPartsIfNothingElseHelps) {
  cutproof::cli::Table table({"name", "kind", "aaaaaaaa", "bbbbbbbb", "cccccccc"});
  table.add({"x", "y", "1", "2", "3"});
  EXPECT_EQ(table.text(2, 30),
            "  name  kind  aaaaaaaa\n"
            "  x        y         1\n"
            "\n"
            "  name  kind  bbbbbbbb\n"
            "  x        y         2\n"
            "\n"
            "  name  kind  cccccccc\n"
            "  x        y         3\n");
}

}  // namespace
}  // namespace table_test
