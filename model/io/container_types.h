// Which types are containers, for visitors of fields of any type.
#pragma once
#include <optional>
#include <vector>

namespace cutproof::io {

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;
template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;

}  // namespace cutproof::io
