// Overlapping clusters of particles, each with a shape matching constraint (method.md §2; paper §2.1).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "model/vec.h"

namespace cutproof {

struct Clusters {
  std::vector<int64_t> offsets = {0};  // [m + 1] cluster c owns members[offsets[c] .. offsets[c + 1])
  std::vector<int32_t> members;        // particles, strictly ascending within each cluster
  std::vector<int32_t> number;         // [m] strictly ascending; 0 .. m - 1 at the end of a frame (method.md §5)
  std::vector<Mat3> rotation;          // [m] last R_c
  std::vector<Vec3> rest_center;       // [m] T_c = Σ w_ic X_i / M_c [m], body frame
  std::vector<double> mass;            // [m] M_c = Σ w_ic [kg], with w_ic = m_i / n_i
  std::vector<uint8_t> degenerate;     // [m] 1: the last rotation was not unique, or its matrix not finite

  int32_t count() const { return static_cast<int32_t>(offsets.size()) - 1; }
  std::span<const int32_t> of(int32_t cluster) const {
    const auto c = static_cast<std::size_t>(cluster);
    return {members.data() + offsets[c], static_cast<std::size_t>(offsets[c + 1] - offsets[c])};
  }
  int64_t size(int32_t cluster) const {
    const auto c = static_cast<std::size_t>(cluster);
    return offsets[c + 1] - offsets[c];
  }
  friend bool operator==(const Clusters&, const Clusters&) = default;
};

}  // namespace cutproof
