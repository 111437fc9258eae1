// Damage to a state, field by field as model/fields.h lists them: at random, for tests that an oracle survives whatever
// it is given, and by the least change that leaves it well formed.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/fields.h"

namespace cutproof::tests {

// Values that break index arithmetic, and some that are merely wrong.
inline int64_t bad_integer(std::mt19937_64& random) {
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max(), kLeast = std::numeric_limits<int64_t>::min();
  constexpr int64_t kValues[] = {-1, 0, 1, 2, 5, 17, 18, 1000, kMost, kLeast, int64_t{1} << 31, -(int64_t{1} << 31)};
  return kValues[random() % std::size(kValues)];
}

inline double bad_double(std::mt19937_64& random) {
  constexpr double kValues[] = {
      0, -1, 1e300, -1e300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 5e-324};
  return kValues[random() % std::size(kValues)];
}

// A value that breaks what relies on it, of any type that a field may have.
template <class T>
requires std::is_arithmetic_v<T>
void spoil(T& value, std::mt19937_64& random) {
  if constexpr (std::is_same_v<T, bool>) {
    value = !value;
  } else if constexpr (std::is_floating_point_v<T>) {
    value = bad_double(random);
  } else {
    value = static_cast<T>(bad_integer(random));
  }
}
inline void spoil(Vec3& value, std::mt19937_64& random) { value[static_cast<int>(random() % 3)] = bad_double(random); }
inline void spoil(Mat3& value, std::mt19937_64& random) { value.m[random() % 9] = bad_double(random); }
inline void spoil(std::array<int32_t, 3>& value, std::mt19937_64& random) { spoil(value[random() % 3], random); }

// Changes one entry of a list, or its length.
template <class T>
void spoil(std::vector<T>& list, std::mt19937_64& random) {
  const auto n = list.size();
  if (n > 0 && random() % 4 != 0) return spoil(list[random() % n], random);
  switch (random() % 4) {
    case 0:
      return list.clear();
    case 1:
      if (n > 0) list.pop_back();
      return;
    case 2:
      return list.resize(n + 1);
    default:
      return list.resize(n / 2);
  }
}

inline std::size_t field_count() {
  std::size_t count = 0;
  for_each_field([&](const Field&, auto) { ++count; });
  return count;
}

// Damages one field of a state, drawn from all there are.
inline void corrupt(State& state, std::mt19937_64& random) {
  std::size_t left = random() % field_count();
  for_each_field([&](const Field&, auto get) {
    if (left-- == 0) spoil(get(state), random);
  });
}

// --- Changes by which a state stays well formed ----------------------------------------------------------------------

inline void alter(const Field&, double& value) { value = std::nextafter(value, 1e9); }
inline void alter(const Field&, Vec3& value) { value.y = std::nextafter(value.y, 1e9); }
inline void alter(const Field&, Mat3& value) { value.m[4] = std::nextafter(value.m[4], 1e9); }
inline void alter(const Field&, bool& value) { value = !value; }
inline void alter(const Field&, std::array<int32_t, 3>& value) { std::swap(value[0], value[1]); }
inline void alter(const Field& field, uint8_t& value) {
  value = static_cast<uint8_t>((value + 1) % (field.quantity == Quantity::direction ? 6 : 2));
}
inline void alter(const Field&, int64_t& value) { value += 2; }
inline void alter(const Field& field, int32_t& value) {
  value = field.quantity == Quantity::particle ? (value == 1 ? 0 : 1) : value + 1;
}
// The last entry that can be changed: offsets begin with 0 and end with the number of members.
template <class T>
void alter(const Field& field, std::vector<T>& list) {
  if (field.space == IndexSpace::state) {
    list = list.empty() ? std::vector<T>{0} : std::vector<T>{};
    return;
  }
  alter(field, list.at(list.size() - (field.space == IndexSpace::cluster_end ? 2 : 1)));
}

}  // namespace cutproof::tests
