// Draws that are the same on every platform: std::uniform_int_distribution is not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <random>

#include "model/at.h"

namespace cutproof::property_tests {

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  // Both ends included. The bias of the remainder, count / 2^64, does not matter to a test.
  int32_t between(int32_t low, int32_t high) {
    const uint64_t count = static_cast<uint64_t>(int64_t{high} - low) + 1;
    return static_cast<int32_t>(low + static_cast<int64_t>(engine_() % count));
  }
  // Of one of `count` things.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(between(0, static_cast<int32_t>(count) - 1)); }
  double real(double low, double high) { return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53; }
  bool chance(double probability) { return real(0, 1) < probability; }
  uint64_t seed() { return engine_(); }
  template <typename T>
  T pick(std::initializer_list<T> of) {
    return of.begin()[index(of.size())];
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace cutproof::property_tests
