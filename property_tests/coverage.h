// Which classes of cases, or of histories, have occurred, and how often. A class that never occurs means that nothing
// was tested there, so every class must (architecture.md, Properties: rapidcheck has no coverage assertions).
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "model/at.h"

namespace cutproof::property_tests {

// `names`: an array of the classes' names.
template <const auto& names>
class Coverage {
 public:
  // Throws std::logic_error if there is no class of this name.
  int64_t& operator[](std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) throw std::logic_error("There is no class named '" + std::string(name) + "'.");
    return counts_[at(found - names.begin())];
  }
  void add(const Coverage& other) {
    for (std::size_t k = 0; k < names.size(); ++k) counts_[k] += other.counts_[k];
  }
  // In the order of `names`.
  auto begin() const { return counts_.begin(); }
  auto end() const { return counts_.end(); }
  friend bool operator==(const Coverage&, const Coverage&) = default;

 private:
  std::array<int64_t, names.size()> counts_ = {};
};

}  // namespace cutproof::property_tests
