// Words of a text, such as those by which a plugin promises.
#pragma once
#include <algorithm>
#include <string_view>
#include <vector>

namespace cutproof {

// Those between spaces, in their order.
inline std::vector<std::string_view> words_in(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (end > 0) words.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

}  // namespace cutproof
