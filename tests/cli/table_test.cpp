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

}  // namespace
