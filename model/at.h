// Numbers as indices of containers.
#pragma once
#include <cstddef>

namespace cutproof {

// Says that a number (of a particle, of a cluster, of a stage) is meant as an index: they are signed everywhere.
template <class Number>
constexpr std::size_t at(Number index) {
  return static_cast<std::size_t>(index);
}

}  // namespace cutproof
