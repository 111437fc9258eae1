// Contacts of one particle with the blade and the walls within one substep (method.md §3). Everything works on
// displacements from rest. A distance to the blade is (X - edge) + d, with X - edge formed and rounded once, and a
// projection is added to d. So a particle far from the body's origin loses no more than that one rounding.
#pragma once
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

// A particle at rest: h · node, with node exact.
struct RestPoint {
  float h;
  Float3 node;
  // X - origin, rounded once.
  CUTPROOF_DEVICE Float3 from(Float3 origin) const {
    return {fmaf(h, node.x, -origin.x), fmaf(h, node.y, -origin.y), fmaf(h, node.z, -origin.z)};
  }
};

// The forbidden set of a body's particles in one substep.
struct Contacts {
  const WallF* walls;
  int wall_count;
  const MoveF* move;  // null: no blade here
  float half_length, depth, clearance, blade_friction;
  bool frictionless;
};

CUTPROOF_DEVICE inline Contacts contacts_of(const DeviceView& w, const Pace& pace, int substep) {
  Contacts contacts;
  contacts.walls = w.walls + pace.wall_begin;
  contacts.wall_count = pace.wall_count;
  contacts.move = nullptr;
  if (pace.first_move >= 0 && substep < pace.substeps) {  // read before the substep is known to exist
    const MoveF* const move = w.moves + (pace.first_move + substep);
    if (constant(&move->down) != 0) contacts.move = move;
  }
  contacts.half_length = pace.half_length;
  contacts.depth = pace.depth;
  contacts.clearance = pace.clearance;
  contacts.blade_friction = contacts.move != nullptr ? pace.blade_friction : 0.0f;
  contacts.frictionless = contacts.blade_friction == 0 && pace.frictionless_walls != 0;
  return contacts;
}

namespace contacts_detail {

// In the blade's frame: along the cutting edge, towards the back, along the positive normal.
CUTPROOF_DEVICE inline Float3 into_frame(const PoseF& pose, Float3 from_edge) {
  return {dot(from_edge, pose.along), dot(from_edge, pose.back), dot(from_edge, pose.normal)};
}
CUTPROOF_DEVICE inline Float3 out_of_frame(const PoseF& pose, Float3 local) {
  return local.x * pose.along + local.y * pose.back + local.z * pose.normal;
}
CUTPROOF_DEVICE inline bool same(Float3 a, Float3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

CUTPROOF_DEVICE inline float along_axis(Float3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }
CUTPROOF_DEVICE inline void set_axis(Float3& a, int axis, float value) {
  a.x = axis == 0 ? value : a.x;
  a.y = axis == 1 ? value : a.y;
  a.z = axis == 2 ? value : a.z;
}

// How deep a particle is in a wall; not positive: outside.
CUTPROOF_DEVICE inline float depth_in(const WallF& wall, const RestPoint& rest, Float3 d) {
  const float to_wall = fmaf(-rest.h, along_axis(rest.node, wall.axis), wall.offset);  // offset - X
  return static_cast<float>(wall.side) * (to_wall - along_axis(d, wall.axis));
}

CUTPROOF_DEVICE inline Float3 off_walls(const Contacts& contacts, const RestPoint& rest, Float3 d) {
  CUTPROOF_ROLLED
  for (int k = 0; k < contacts.wall_count; ++k) {
    const WallF wall = constant(&contacts.walls[k]);
    if (depth_in(wall, rest, d) > 0) {
      set_axis(d, wall.axis, fmaf(-rest.h, along_axis(rest.node, wall.axis), wall.offset));
    }
  }
  return d;
}

// In the blade's frame: whether a point is over the mid-surface, and the vector from the nearest point of the
// mid-surface.
CUTPROOF_DEVICE inline bool is_over_blade(const Contacts& contacts, Float3 c) {
  return fabsf(c.x) < contacts.half_length && c.y > 0 && c.y < contacts.depth;
}
CUTPROOF_DEVICE inline Float3 from_blade(const Contacts& contacts, Float3 c) {
  return {c.x - fminf(fmaxf(c.x, -contacts.half_length), contacts.half_length),
          c.y - fminf(fmaxf(c.y, 0.0f), contacts.depth), c.z};
}

// The way out, in the blade's frame, of a particle that passed through the plate: back to its own side, or round one of
// the rectangle's four sides to where it clears the rounded rim. The shortest way counts, of equal ways the one to its
// own side.
CUTPROOF_DEVICE inline Float3 way_out(const Contacts& contacts, Float3 c, float side) {
  Float3 best = {0, 0, side * contacts.clearance - c.z};
  float shortest = dot(best, best);
  const float beyond = -side * fmaxf(fabsf(c.z), contacts.clearance) - c.z;
  const auto consider = [&](float u, float back) {
    const Float3 way = {u, back, beyond};
    const float length = dot(way, way);
    if (length < shortest) {
      best = way;
      shortest = length;
    }
  };
  consider(0, -c.y);
  consider(0, contacts.depth - c.y);
  consider(-contacts.half_length - c.x, 0);
  consider(contacts.half_length - c.x, 0);
  return best;
}

// The displacement of a particle off the blade, zero where it is allowed. Two sets are forbidden: points nearer to the
// mid-surface than the clearance, and points over it on the side where the particle did not begin. A difference of two
// positions would lose its direction where it is short. Requires contacts.move.
CUTPROOF_DEVICE inline Float3 way_off_blade(const Contacts& contacts, const RestPoint& rest, Float3 d, float side) {
  const PoseF pose = constant(&contacts.move->to);
  const Float3 c = into_frame(pose, rest.from(pose.edge) + d);
  Float3 way;
  if (is_over_blade(contacts, c)) {
    const float height = side * c.z;
    if (height >= contacts.clearance) return {};
    way = height >= 0 ? Float3{0, 0, side * contacts.clearance - c.z} : way_out(contacts, c, side);
  } else {
    const Float3 offset = from_blade(contacts, c);
    const float distance = norm(offset);
    if (distance >= contacts.clearance) return {};
    way =
        distance > 0 ? ((contacts.clearance - distance) / distance) * offset : Float3{0, 0, side * contacts.clearance};
  }
  return out_of_frame(pose, way);
}
CUTPROOF_DEVICE inline Float3 off_blade(const Contacts& contacts, const RestPoint& rest, Float3 d, float side) {
  return d + way_off_blade(contacts, rest, d, side);
}

// Whether a particle touches a contact, or nearly so (kTouchMargin).
CUTPROOF_DEVICE inline bool touches(const Contacts& contacts, const RestPoint& rest, Float3 d, float side) {
  const float margin = static_cast<float>(kTouchMargin) * rest.h;
  CUTPROOF_ROLLED
  for (int k = 0; k < contacts.wall_count; ++k) {
    if (depth_in(constant(&contacts.walls[k]), rest, d) > -margin) return true;
  }
  if (contacts.move == nullptr) return false;
  const PoseF pose = constant(&contacts.move->to);
  const Float3 c = into_frame(pose, rest.from(pose.edge) + d);
  if (is_over_blade(contacts, c)) {
    return side * c.z < contacts.clearance + margin;
  }
  return norm(from_blade(contacts, c)) < contacts.clearance + margin;
}

inline constexpr int kMostTurns = 16;  // alternating projections on blade and walls

// The allowed point nearest to d, exact unless blade and walls both move it. Then their projections alternate, the
// blade last, and `in_turn` is set.
CUTPROOF_DEVICE inline Float3 allowed(const Contacts& contacts, const RestPoint& rest, Float3 d, float side,
                                      bool& in_turn) {
  if (contacts.move == nullptr) return off_walls(contacts, rest, d);
  bool by_blade = false;
  CUTPROOF_ROLLED
  for (int turn = 0;; ++turn) {
    const Float3 result = off_blade(contacts, rest, d, side);
    by_blade = by_blade || !same(result, d);
    if (turn > 0) {
      in_turn = by_blade;
      if (turn == kMostTurns || same(result, d)) return result;
    }
    d = off_walls(contacts, rest, result);
    if (same(d, result)) return result;
  }
}

// Reduces the slip `slid` along the surface with this normal by at most `reach`.
CUTPROOF_DEVICE inline Float3 rubbed(Float3 d, Float3 slid, Float3 normal, float reach) {
  const Float3 along = slid - dot(slid, normal) * normal;
  const float length = norm(along);
  return length > 0 ? d - fminf(1.0f, reach / length) * along : d;
}

}  // namespace contacts_detail

// The side of the blade, +1 or -1, of a particle when the substep begins.
CUTPROOF_DEVICE inline float blade_side(const Contacts& contacts, const RestPoint& rest, Float3 d) {
  if (contacts.move == nullptr) return 1.0f;
  const PoseF pose = constant(&contacts.move->from);
  return contacts_detail::into_frame(pose, rest.from(pose.edge) + d).z < 0 ? -1.0f : 1.0f;
}

// The position that contacts allow a particle at d. It began the substep at `start`, on side `side` of the blade. Sets
// `in_turn` where this need not be the nearest allowed point, and does not change it elsewhere.
CUTPROOF_DEVICE inline Float3 project(const Contacts& contacts, const RestPoint& rest, Float3 d, float side,
                                      Float3 start, bool& in_turn) {
  using namespace contacts_detail;
  Float3 result = d;
  CUTPROOF_ROLLED
  for (bool rubs = false;; rubs = true) {
    bool turns = false;
    const Float3 projected = allowed(contacts, rest, result, side, turns);
    in_turn = in_turn || turns;
    // Blade and wall can press on a point without moving it; friction still acts.
    if (rubs || contacts.frictionless || (same(projected, d) && !turns)) return projected;
    result = projected;
    CUTPROOF_ROLLED
    for (int k = 0; k < contacts.wall_count; ++k) {
      const WallF wall = constant(&contacts.walls[k]);
      const float depth = depth_in(wall, rest, d);
      if (depth <= 0 || wall.friction == 0) continue;
      Float3 normal;
      set_axis(normal, wall.axis, static_cast<float>(wall.side));
      result = rubbed(result, result - start, normal, wall.friction * depth);
    }
    if (contacts.blade_friction > 0) {
      const Float3 pushed = way_off_blade(contacts, rest, d, side);
      const float depth = norm(pushed);
      if (depth > 0) {
        // The blade's point under the particle has moved too; friction opposes the relative slip only.
        const PoseF from = constant(&contacts.move->from), to = constant(&contacts.move->to);
        const Float3 c = into_frame(to, rest.from(to.edge) + result);
        const Float3 carried = (to.edge - from.edge) + c.x * (to.along - from.along) + c.y * (to.back - from.back) +
                               c.z * (to.normal - from.normal);
        result = rubbed(result, result - start - carried, (1.0f / depth) * pushed, contacts.blade_friction * depth);
      }
    }
  }
}

// For a solver that moves the particle from x towards `free`. Alternating projections of blade and walls need not give
// the nearest point, so a point worse than x is rejected and the energy cannot grow. An exact projection needs no such
// test, which would reject motions below the root of the rounding.
CUTPROOF_DEVICE inline Float3 next_position(const Contacts& contacts, const RestPoint& rest, Float3 free, float side,
                                            Float3 start, Float3 x) {
  bool in_turn = false;
  const Float3 next = project(contacts, rest, free, side, start, in_turn);
  if (!in_turn || !contacts.frictionless) return next;
  constexpr float kRounds = static_cast<float>(kRefusalRoundings) * 0x1p-24f;
  const float present = norm(x - free);
  const bool worse = norm(next - free) > present + kRounds * (present + norm(x));
  return worse ? x : next;
}

// Points of the body within `radius` of one point, all with the same displacement.
struct Ball {
  RestPoint rest;
  Float3 d;
  float radius;
};

namespace contacts_detail {

// Coordinates are rounded a few times each, by units of their greatest number.
inline constexpr float kRounds = 32 * 0x1p-24f;
CUTPROOF_DEVICE inline float extent(Float3 a) { return fabsf(a.x) + fabsf(a.y) + fabsf(a.z); }
CUTPROOF_DEVICE inline float ball_extent(const Ball& ball) {
  return ball.rest.h * extent(ball.rest.node) + extent(ball.d);
}

}  // namespace contacts_detail

// The least growth of a ball's radius before some point in it is projected, or touches (kTouchMargin). If it is not
// positive, the ball is not clear. side: the side of the blade on which all points of the ball began the substep, or 0
// if they began on both.
//
// Distance from the plate is not enough: a point over the plate is projected from any distance if it began on the other
// side. So either the whole ball stays on its side, or it keeps clear of everything over and under the plate.
CUTPROOF_DEVICE inline float room_around(const Contacts& contacts, const Ball& ball, int side) {
  using namespace contacts_detail;
  const RestPoint& rest = ball.rest;
  const float size = ball_extent(ball);
  const float reach = ball.radius * (1.0f + kRounds) + static_cast<float>(kTouchMargin) * rest.h;
  const auto least = [](float a, float b) { return a < b || a != a ? a : b; };  // NaN if one of them is
  float room = 3.0e38f;
  CUTPROOF_ROLLED
  for (int k = 0; k < contacts.wall_count; ++k) {
    const WallF wall = constant(&contacts.walls[k]);
    const float slack = kRounds * (size + fabsf(wall.offset));
    room = least(room, -depth_in(wall, rest, ball.d) - (reach + slack));
  }
  if (contacts.move == nullptr) return room;
  const PoseF pose = constant(&contacts.move->to);
  const float clear = reach + kRounds * (size + extent(pose.edge));
  const Float3 c = into_frame(pose, rest.from(pose.edge) + ball.d);
  const Float3 away = from_blade(contacts, c);
  float of_blade = least(sqrtf(away.x * away.x + away.y * away.y) - clear, norm(away) - (contacts.clearance + clear));
  if (side != 0) of_blade = fmaxf(of_blade, static_cast<float>(side) * c.z - (contacts.clearance + clear));
  return least(room, of_blade);
}
// The side of the blade, +1 or -1, of all points of a ball when the substep begins, as blade_side gives for each; 0:
// not certainly one side.
CUTPROOF_DEVICE inline int side_of_all(const Contacts& contacts, const Ball& ball) {
  using namespace contacts_detail;
  if (contacts.move == nullptr) return 1;
  const PoseF pose = constant(&contacts.move->from);
  const float reach = ball.radius * (1.0f + kRounds) + kRounds * (ball_extent(ball) + extent(pose.edge));
  const float height = into_frame(pose, ball.rest.from(pose.edge) + ball.d).z;
  return height > reach ? 1 : height < -reach ? -1 : 0;
}
CUTPROOF_DEVICE inline bool is_clear(const Contacts& contacts, const Ball& ball, int side) {
  return room_around(contacts, ball, side) > 0;
}

// With friction or a non-convex allowed set an iteration can have several fixed points.
CUTPROOF_DEVICE inline bool path_matters(const Contacts& contacts) {
  return contacts.move != nullptr || !contacts.frictionless;
}

}  // namespace cutproof::gpu
