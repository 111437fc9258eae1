#include "reference_cpu/contacts.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cutproof::reference {

namespace {

// Most alternating projections on blade and walls.
constexpr int kMostTurns = 16;

}  // namespace

Contacts::Frame Contacts::frame_of(const BladePose& pose) {
  return {pose.edge, pose.along, pose.back, cross(pose.along, pose.back)};
}

Contacts::Contacts(const Setup& setup, const BladeMove* move) : setup_(setup) {
  for (const Wall& wall : setup.walls) frictionless_ = frictionless_ && wall.friction == 0;
  // A geometric blade removes tissue and touches nothing.
  if (move == nullptr || setup.detect.criterion == Criterion::geometric) return;
  has_blade_ = true;
  frictionless_ = frictionless_ && setup.blade.friction == 0;
  from_ = frame_of(move->from);
  to_ = frame_of(move->to);
  half_length_ = setup.blade.length / 2;
  depth_ = setup.blade.depth;
  clearance_ = blade_clearance(setup);
}

int Contacts::side(Vec3 x) const { return has_blade_ && from_.local(x).z < 0 ? -1 : +1; }

Vec3 Contacts::project_on_walls(Vec3 x) const {
  for (const Wall& wall : setup_.walls) {
    if (wall.side * (x[wall.axis] - wall.offset) < 0) x[wall.axis] = wall.offset;
  }
  return x;
}

bool Contacts::is_over(Vec3 c) const { return std::abs(c.x) < half_length_ && c.y > 0 && c.y < depth_; }

Vec3 Contacts::nearest_on_blade(Vec3 c) const {
  return {std::clamp(c.x, -half_length_, half_length_), std::clamp(c.y, 0.0, depth_), 0};
}

// In the blade's frame a point is (u, w, n) with the mid-surface at n = 0, |u| <= L/2, 0 <= w <= D. Two sets are
// forbidden:
// - (a) points nearer to the mid-surface than the clearance ρ;
// - (b) points over the mid-surface, on the side where the particle did not begin: it must have passed through the
//   blade.
Vec3 Contacts::way_off_blade(Vec3 x, int side) const {
  const Vec3 c = to_.local(x);
  if (is_over(c)) {
    const double height = side * c.z;
    if (height >= clearance_) return {};
    return to_.direction(height >= 0 ? Vec3{0, 0, side * clearance_ - c.z} : way_round_a_side(c, side));
  }
  const Vec3 offset = c - nearest_on_blade(c);
  const double distance = norm(offset);
  if (distance >= clearance_) return {};
  if (distance == 0) return to_.direction({0, 0, side * clearance_});
  return to_.direction(((clearance_ - distance) / distance) * offset);
}

Vec3 Contacts::project_on_blade(Vec3 x, int side) const { return x + way_off_blade(x, side); }

bool Contacts::touches(Vec3 x, int side) const {
  const double margin = kTouchMargin * setup_.body.grid.spacing;
  for (const Wall& wall : setup_.walls) {
    if (wall.side * (x[wall.axis] - wall.offset) < margin) return true;
  }
  if (!has_blade_) return false;
  const Vec3 c = to_.local(x);
  return (is_over(c) ? side * c.z : norm(c - nearest_on_blade(c))) < clearance_ + margin;
}

// The shortest way for a particle that passed through the blade: back to its own side, or round one of the rectangle's
// four sides. There it has to clear the rounded rim, so it stays at least ρ from the plane.
Vec3 Contacts::way_round_a_side(Vec3 c, int side) const {
  Vec3 best = {0, 0, side * clearance_ - c.z};
  const double beyond = -side * std::max(std::abs(c.z), clearance_) - c.z;
  for (const Vec3 way : {Vec3{0, -c.y, beyond}, Vec3{0, depth_ - c.y, beyond}, Vec3{-half_length_ - c.x, 0, beyond},
                         Vec3{half_length_ - c.x, 0, beyond}}) {
    if (norm(way) < norm(best)) best = way;
  }
  return best;
}

Vec3 Contacts::project(Vec3 x, int side, bool* in_turn) const {
  if (!has_blade_) return project_on_walls(x);
  Vec3 result = project_on_blade(x, side);
  bool by_blade = !(result == x);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const Vec3 inside = project_on_walls(result);
    if (inside == result) return result;
    result = project_on_blade(inside, side);
    by_blade = by_blade || !(result == inside);
    if (in_turn != nullptr && by_blade) *in_turn = true;
    if (result == inside) return result;
  }
  return result;
}

// Coulomb friction in position form (Müller et al. 2007, Macklin et al. 2014 §6.1). A contact that moved the particle
// by δ along its normal reduces the tangential slip since the substep began by min(slip, μ δ).
Vec3 Contacts::project_with_friction(Vec3 x, int side, Vec3 start, bool* in_turn) const {
  bool turns = false;
  const Vec3 projected = project(x, side, &turns);
  if (in_turn != nullptr && turns) *in_turn = true;
  // Blade and wall can press on a point without moving it; friction still acts.
  if (frictionless_ || (projected == x && !turns)) return projected;
  Vec3 result = projected;
  const auto rub = [&result](Vec3 slid, Vec3 normal, double reach) {
    const Vec3 along = slid - dot(slid, normal) * normal;
    const double length = norm(along);
    if (length > 0) result -= std::min(1.0, reach / length) * along;
  };
  for (const Wall& wall : setup_.walls) {
    const double depth = wall.side * (wall.offset - x[wall.axis]);
    if (depth <= 0 || wall.friction == 0) continue;
    Vec3 normal;
    normal[wall.axis] = wall.side;
    rub(result - start, normal, wall.friction * depth);
  }
  if (has_blade_ && setup_.blade.friction > 0) {
    const Vec3 pushed = way_off_blade(x, side);
    const double depth = norm(pushed);
    if (depth > 0) {
      // The blade's point under the particle has moved too; friction opposes the relative slip only.
      const Vec3 carried = result - from_.global(to_.local(result));
      rub(result - start - carried, pushed / depth, setup_.blade.friction * depth);
    }
  }
  return project(result, side, in_turn);
}

Vec3 Contacts::next_position(Vec3 free, int side, Vec3 start, Vec3 x) const {
  bool in_turn = false;
  const Vec3 next = project_with_friction(free, side, start, &in_turn);
  const double present = norm(x - free);
  const bool worse = norm(next - free) > present + kRefusalRoundings * 0x1p-53 * (present + norm(x));
  return in_turn && frictionless() && worse ? x : next;
}

}  // namespace cutproof::reference
