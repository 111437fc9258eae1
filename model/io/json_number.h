// Numbers in result documents.
#pragma once
#include <cmath>
#include <nlohmann/json.hpp>

namespace cutproof {

// JSON has no NaN and no infinity; they are written as the words that a reader can tell from a number.
inline nlohmann::json json_number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

}  // namespace cutproof
