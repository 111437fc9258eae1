// Shared code of reading, writing and documenting scenes: kinds of fields, and their names and numbers as text.
#pragma once
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>

#include "model/io/container_types.h"
#include "model/io/scene_fields.h"
#include "model/rules.h"

namespace cutproof::io {

template <class T>
inline constexpr bool is_integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;

// Whether the table describes T.
template <class T>
inline constexpr bool has_fields = requires(int& visitor, T& value) {
  describe(visitor, value);
};

inline std::string number_text(double x) { return fmt::format("{}", x); }

// The names of a choice, each in quotes.
template <NamedChoice E>
std::string all_names(const std::string& quote) {
  return quote + fmt::format("{}", fmt::join(names_of(E{}), quote + ", " + quote)) + quote;
}

}  // namespace cutproof::io
