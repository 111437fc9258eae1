#include "cli/table.h"

#include <gtest/gtest.h>

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

}  // namespace
