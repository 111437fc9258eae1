// Stages that the reference ran because the backend under test cannot, in words.
#pragma once
#include <string>
#include <vector>

namespace cutproof {

// "The reference ran step, detect and skin for the backend: not judged." Requires a name.
inline std::string left_in_words(const std::vector<std::string>& stages) {
  std::string names;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    names += k == 0 ? "" : k + 1 < stages.size() ? ", " : " and ";
    names += stages[k];
  }
  return "The reference ran " + names + " for the backend: not judged.";
}

}  // namespace cutproof
