// Numbers in documents.
#pragma once
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace cutproof {

// JSON has no NaN and no infinity; they are written as the words that a reader can tell from a number. An absent number
// is null.
inline nlohmann::json json_number(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

inline nlohmann::json json_number(const std::optional<double>& value) {
  return value ? json_number(*value) : nlohmann::json(nullptr);
}

// The whole number that a value from outside is. Throws std::invalid_argument if it is none, or T does not reach so
// far: nlohmann's get() makes an integer of any number, which for 1e93 has no defined result.
template <std::integral T>
T integer_from(const nlohmann::json& value) {
  if (value.is_number_unsigned()) {
    if (const auto number = value.get<uint64_t>(); std::in_range<T>(number)) return static_cast<T>(number);
  } else if (value.is_number_integer()) {
    if (const auto number = value.get<int64_t>(); std::in_range<T>(number)) return static_cast<T>(number);
  }
  throw std::invalid_argument(value.dump().substr(0, 60) + " is not a whole number from " +
                              std::to_string(std::numeric_limits<T>::min()) + " to " +
                              std::to_string(std::numeric_limits<T>::max()));
}

}  // namespace cutproof
