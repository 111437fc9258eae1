// Whole numbers from outside.
#include "model/io/json_number.h"

#include <gtest/gtest.h>

#include <limits>

namespace cutproof::json_number_test {
namespace {

using nlohmann::json;

TEST(IntegerFrom, IsReadWhereTheTypeReachesSoFar) {
  EXPECT_EQ(integer_from<int>(json::parse("-7")), -7);
  EXPECT_EQ(integer_from<uint8_t>(json::parse("255")), 255);
  EXPECT_EQ(integer_from<int32_t>(json::parse("-2147483648")), std::numeric_limits<int32_t>::min());
  EXPECT_EQ(integer_from<int64_t>(json::parse("9223372036854775807")), std::numeric_limits<int64_t>::max());
  EXPECT_EQ(integer_from<uint64_t>(json::parse("18446744073709551615")), std::numeric_limits<uint64_t>::max());
}

TEST(IntegerFrom, IsRefusedBeyondItAndIfItIsNone) {
  EXPECT_THROW(integer_from<uint8_t>(json::parse("256")), std::invalid_argument);
  EXPECT_THROW(integer_from<uint8_t>(json::parse("-1")), std::invalid_argument);
  EXPECT_THROW(integer_from<int32_t>(json::parse("2147483648")), std::invalid_argument);
  EXPECT_THROW(integer_from<uint64_t>(json::parse("-1")), std::invalid_argument);
  EXPECT_THROW(integer_from<int64_t>(json::parse("9223372036854775808")), std::invalid_argument);
  for (const char* text : {"4.6e93", "-2e36", "1.5", "1.0", "true", "null", "\"7\"", "[7]", "{}"}) {
    EXPECT_THROW(integer_from<int64_t>(json::parse(text)), std::invalid_argument) << text;
    EXPECT_THROW(integer_from<uint64_t>(json::parse(text)), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace cutproof::json_number_test
