// Indices as containers want them.
#pragma once
#include <cstddef>

namespace cutproof::benchmarks {

// A number, or a stage among the six.
template <typename Index>
constexpr std::size_t at(Index index) {
  return static_cast<std::size_t>(index);
}

}  // namespace cutproof::benchmarks
