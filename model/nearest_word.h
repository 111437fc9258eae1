// Which word was meant.
#pragma once
#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cutproof {

// Levenshtein's distance: insertions, deletions and substitutions from one word to the other.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row[b.size()];
}

// The first of the known words that are nearest to the given one. Empty if more than half of its letters, and more than
// two, would have to change. `known`: a range of texts.
template <class Words>
std::string nearest_word(std::string_view given, const Words& known) {
  std::string nearest;
  std::size_t least = 0;
  if (given.size() > 200) return nearest;  // no typing error
  for (const auto& each : known) {
    const std::string_view word(each);
    const std::size_t distance = edit_distance(given, word);
    if (distance > std::max<std::size_t>(2, word.size() / 2) || distance >= std::max(given.size(), word.size()))
      continue;
    if (!nearest.empty() && distance >= least) continue;
    nearest = word;
    least = distance;
  }
  return nearest;
}

// The beginning of a remedy: "did you mean 'x'? ", or nothing.
template <class Words>
std::string did_you_mean(std::string_view given, const Words& known) {
  const std::string nearest = nearest_word(given, known);
  return nearest.empty() ? nearest : "did you mean '" + nearest + "'? ";
}

}  // namespace cutproof
