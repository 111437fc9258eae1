// Numbers in result documents.
#pragma once
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace cutproof {

// JSON has no NaN and no infinity; they are written as the words that a reader can tell from a number. What is absent
// is null.
inline nlohmann::json json_number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

inline nlohmann::json json_number(const std::optional<double>& value) {
  return value ? json_number(*value) : nlohmann::json(nullptr);
}

}  // namespace cutproof
