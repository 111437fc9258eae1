// Which allocations the tests let fail: a sample, or by CUTPROOF_ALLOCATIONS more of them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace cutproof::tests {

inline std::string setting(const char* name, const std::string& otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

// CUTPROOF_SEED, or one that nobody knows.
inline uint64_t sample_seed() { return std::stoull(setting("CUTPROOF_SEED", std::to_string(std::random_device{}()))); }

// CUTPROOF_ALLOCATIONS: "all"; "I/N", the I-th of N shares of all, for machines or cores side by side; or how many of
// each case.
struct WantedAllocations {
  bool all = false;
  uint64_t share = 1, shares = 1;  // of all
  uint64_t count = 0;              // unless all
};
inline WantedAllocations wanted_allocations(uint64_t otherwise) {
  const std::string text = setting("CUTPROOF_ALLOCATIONS", std::to_string(otherwise));
  if (text == "all") return {.all = true};
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return {.count = std::stoull(text)};
  const WantedAllocations wanted = {
      .all = true, .share = std::stoull(text), .shares = std::stoull(text.substr(slash + 1))};
  if (wanted.share < 1 || wanted.share > wanted.shares) throw std::out_of_range("CUTPROOF_ALLOCATIONS=" + text);
  return wanted;
}

// Numbers from 1 to `most`: all of the share, or one from each of as many equal parts as are wanted.
inline std::vector<uint64_t> chosen_numbers(uint64_t most, const WantedAllocations& wanted, uint64_t seed) {
  std::vector<uint64_t> chosen;
  if (wanted.all) {
    for (uint64_t number = wanted.share; number <= most; number += wanted.shares) chosen.push_back(number);
    return chosen;
  }
  const uint64_t parts = std::min(wanted.count, most);
  std::mt19937_64 random(seed);
  for (uint64_t part = 0; part < parts; ++part) {
    const uint64_t from = part * most / parts, to = (part + 1) * most / parts;
    chosen.push_back(1 + from + random() % (to - from));
  }
  return chosen;
}

}  // namespace cutproof::tests
