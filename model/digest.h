// Digests: 64 bits that tell contents apart. Not cryptographic.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/fields.h"

namespace cutproof {

class Digest {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* from = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; i += 8) {
      uint64_t word = 0;
      std::memcpy(&word, from + i, std::min<std::size_t>(8, bytes - i));
      value_ = (value_ ^ word) * 0x9E3779B97F4A7C15u;
      value_ ^= value_ >> 32;
    }
    value_ = (value_ ^ bytes) * 0x9E3779B97F4A7C15u;
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void add(const T& value) { add(&value, sizeof value); }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.data(), values.size() * sizeof(T));
  }
  void add(std::string_view text) { add(text.data(), text.size()); }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xcbf29ce484222325u;
};

// Equal for states of which every field has the same bits, however they were computed.
inline uint64_t digest(const State& state) {
  Digest digest;
  for_each_field([&](const Field&, auto get) { digest.add(get(state)); });
  return digest.value();
}

}  // namespace cutproof
