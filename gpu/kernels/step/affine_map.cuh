// The affine map M(r) = a + L h r by which an iteration moves the particles of a group; r = X - X_g is in nodes.
#pragma once
#include "gpu/launch/team.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// M of one group. row[k]: {row k of h L, a_k} (arrays.inc).
struct Map {
  Float4 row[3];
  // L (h r)
  CUTPROOF_DEVICE Float3 linear(Float3 r) const {
    return {row[0].x * r.x + row[0].y * r.y + row[0].z * r.z, row[1].x * r.x + row[1].y * r.y + row[1].z * r.z,
            row[2].x * r.x + row[2].y * r.y + row[2].z * r.z};
  }
  CUTPROOF_DEVICE Float3 moved() const { return {row[0].w, row[1].w, row[2].w}; }
  // a + L (h r)
  CUTPROOF_DEVICE Float3 operator()(Float3 r) const { return moved() + linear(r); }
};
CUTPROOF_DEVICE inline Map load_map(const Float4* rows, int g) {
  return {{rows[3 * int64_t{g}], rows[3 * int64_t{g} + 1], rows[3 * int64_t{g} + 2]}};
}
// The row whose entries are of(entry of a, entry of b).
template <class Of>
CUTPROOF_DEVICE Float4 row_of(Of of, Float4 a, Float4 b) {
  return {of(a.x, b.x), of(a.y, b.y), of(a.z, b.z), of(a.w, b.w)};
}
CUTPROOF_DEVICE inline float entry(const Map& map, int row, int k) {
  const Float4 r = map.row[row];
  return k == 0 ? r.x : k == 1 ? r.y : k == 2 ? r.z : r.w;
}

// The rows of a map. Each is in the lane to which Team::each gives the item of its axis.
template <class AnyTeam>
class Rows {
 public:
  CUTPROOF_DEVICE Float4& of(int axis) { return row_[AnyTeam::kLanes >= 3 ? 0 : axis]; }
  CUTPROOF_DEVICE Map all(const AnyTeam& team) {  // to every lane
    static_assert(AnyTeam::kLanes == 1 || AnyTeam::kLanes >= 3);
    return {{team.from(0, of(0)), team.from(1, of(1)), team.from(2, of(2))}};
  }

 private:
  Float4 row_[AnyTeam::kLanes >= 3 ? 1 : 3];
};

// At least |(h diagonal + L) r| for every |r| <= 1 [h]: the root of the greatest sum by rows times the greatest sum by
// columns.
CUTPROOF_DEVICE inline float greatest_stretch(const Map& map, float diagonal) {
  float rows = 0, columns = 0;
  for (int k = 0; k < 3; ++k) {
    float row = 0, column = 0;
    for (int j = 0; j < 3; ++j) {
      row += fabsf(entry(map, k, j) + (j == k ? diagonal : 0.0f));
      column += fabsf(entry(map, j, k) + (j == k ? diagonal : 0.0f));
    }
    rows = fmaxf(rows, row);
    columns = fmaxf(columns, column);
  }
  return sqrtf(rows * columns);
}

// How far at most a map moves a point along the axis of this row, if the point is `radius` [h] from the rest centre.
CUTPROOF_DEVICE inline float way_along(Float4 row, float radius) {
  return fabsf(row.w) + (fabsf(row.x) + fabsf(row.y) + fabsf(row.z)) * radius;
}
// A group stays clear if its map moves it along each axis by at most this part of its room. That is 1 / √3 = 0.57735,
// less a margin for rounding of 6e-4. The way along an axis is rounded 8 times, and room_around() leaves 32 √3
// roundings for farther coordinates: together 4e-6.
inline constexpr float kPartOfRoom = 0.577f;

}  // namespace cutproof::gpu::step_detail
