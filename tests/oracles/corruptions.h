// Random damage to a state, for tests that an oracle survives whatever it is given.
#pragma once
#include <cstdint>
#include <limits>
#include <random>

#include "model/state.h"

namespace cutproof::testing {

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

// Changes one element, or the length, of one of the arrays of a state.
inline void corrupt(State& state, std::mt19937_64& random) {
  const auto resize = [&](auto& array) {
    const auto n = array.size();
    switch (random() % 4) {
      case 0:
        array.clear();
        break;
      case 1:
        if (n > 0) array.pop_back();
        break;
      case 2:
        array.resize(n + 1);
        break;
      default:
        array.resize(n / 2);
        break;
    }
  };
  const auto change = [&](auto& array) {
    if (array.empty()) return resize(array);
    auto& entry = array[random() % array.size()];
    entry = static_cast<std::remove_reference_t<decltype(entry)>>(bad_integer(random));
  };
  const auto either = [&](auto& array) { random() % 4 == 0 ? resize(array) : change(array); };
  const auto vector = [&](auto& array) {
    if (array.empty() || random() % 4 == 0) return resize(array);
    array[random() % array.size()][static_cast<int>(random() % 3)] = bad_double(random);
  };
  switch (random() % 18) {
    case 0:
      return vector(state.x);
    case 1:
      return vector(state.v);
    case 2:
      return either(state.alive);
    case 3:
      return either(state.removed);
    case 4:
      return either(state.debris);
    case 5:
      return either(state.clusters.offsets);
    case 6:
      return either(state.clusters.members);
    case 7:
      return either(state.clusters.number);
    case 8:
      return resize(state.clusters.rotation);
    case 9:
      return vector(state.clusters.rest_center);
    case 10:
      return either(state.clusters.degenerate);
    case 11:
      return either(state.skin.owner);
    case 12:
      return either(state.skin.direction);
    case 13:
      return vector(state.skin.position);
    case 14:
      if (state.skin.triangles.empty()) return;
      state.skin.triangles[random() % state.skin.triangles.size()][random() % 3] =
          static_cast<int32_t>(bad_integer(random));
      return;
    case 15:
      state.frame = bad_integer(random);
      return;
    case 16:
      state.tau = static_cast<int32_t>(bad_integer(random));
      return;
    default:
      state.cap = static_cast<int32_t>(bad_integer(random));
      return;
  }
}

}  // namespace cutproof::testing
