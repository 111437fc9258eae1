// What reading, writing and documenting scenes have in common: kinds of fields, and their names and numbers as text.
#pragma once
#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/io/scene_fields.h"

namespace cutproof::io {

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;
template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;
template <class T>
inline constexpr bool is_integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;

inline std::string join(const std::string& path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

inline std::string number_text(double x) { return fmt::format("{}", x); }

template <class E>
std::string all_words(const char* quote) {
  std::string text;
  for (const auto& [enumerator, word] : words(E{})) {
    text += fmt::format("{}{}{}{}", text.empty() ? "" : ", ", quote, word, quote);
  }
  return text;
}

}  // namespace cutproof::io
