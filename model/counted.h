// Counts in words: "1 edge", "2 edges".
#pragma once
#include <string>
#include <string_view>
#include <utility>

namespace cutproof {

template <class Count>
std::string counted(Count count, std::string_view one, std::string_view many) {
  return std::to_string(count) + ' ' + std::string(std::cmp_equal(count, 1) ? one : many);
}

}  // namespace cutproof
