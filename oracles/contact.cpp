#include "oracles/contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/at.h"

namespace cutproof::oracles {
namespace {

// How often blade and walls are projected in turn where both hold (method.md §3).
constexpr int kTurns = 16;

double length_of(Local c) { return std::hypot(c.u, c.n, c.w); }

}  // namespace

Contact::Contact(const Setup& setup, const BladeMove* move, const std::vector<Wall>& walls) : walls_(walls) {
  for (const Wall& wall : walls_) wall_friction_ = std::max(wall_friction_, wall.friction);
  // A geometric blade removes what it sweeps, and touches nothing.
  has_plate_ = move != nullptr && move->down && setup.detect.criterion != Criterion::geometric;
  if (!has_plate_) return;
  from_ = move->from;
  to_ = move->to;
  half_length_ = setup.blade.length / 2;
  depth_ = setup.blade.depth;
  clearance_ = blade_clearance(setup);
  blade_friction_ = setup.blade.friction;
}

double Contact::height_at_start(Vec3 start) const { return has_plate_ ? to_local(from_, start - from_.edge).n : 1; }

int Contact::side_of_end(Vec3 x, double rim) const {
  if (!has_plate_) return 0;
  const Local c = seen_from_blade(x);
  return !(inside_by(c) > rim) || std::abs(c.n) < clearance_ / 2 ? 0 : c.n < 0 ? -1 : +1;
}

double Contact::rounds(Vec3 x) const {
  double size = has_plate_ ? 6 * norm(x - to_.edge) + norm(to_.edge) : 0;
  for (const Wall& wall : walls_) size = std::max(size, std::abs(wall.offset));
  return size;
}

Vec3 Contact::turned_back(Local c) const { return c.u * to_.along + c.w * to_.back + c.n * cross(to_.along, to_.back); }

double Contact::inside_by(Local c) const { return std::min({half_length_ - std::abs(c.u), c.w, depth_ - c.w}); }

Local Contact::nearest_on_plate(Local c) const {
  return {std::clamp(c.u, -half_length_, half_length_), 0, std::clamp(c.w, 0.0, depth_)};
}

Contact::Depth Contact::depth(Vec3 x, int side, double near) const {
  const double infinity = std::numeric_limits<double>::infinity();
  double deepest = -infinity;
  for (const Wall& wall : walls_) deepest = std::max(deepest, wall.side * (wall.offset - x[wall.axis]));
  if (!has_plate_) return {deepest, deepest};
  const Local c = seen_from_blade(x), on_plate = nearest_on_plate(c);
  const double over = clearance_ - side * c.n,
               beside = clearance_ - length_of({c.u - on_plate.u, c.n, c.w - on_plate.w});
  const double inside = inside_by(c);
  const double least = inside > near ? over : inside < -near ? beside : std::min(over, beside);
  const double most = inside > near ? over : inside < -near ? beside : std::max(over, beside);
  return {std::max(deepest, least), std::max(deepest, most)};
}

Local Contact::on_border(Local c, double near) const {
  if (std::abs(c.n) <= near) c.n = 0;
  if (std::abs(c.w) <= near) c.w = 0;
  if (std::abs(c.w - depth_) <= near) c.w = depth_;
  if (std::abs(std::abs(c.u) - half_length_) <= near) c.u = std::copysign(half_length_, c.u);
  return c;
}

// Forbidden are places nearer than ρ to the rectangle, and places over it on the side where the particle did not begin.
Vec3 Contact::way_off_plate(Vec3 x, int side, Found& found, const Rounding& rounding) const {
  Local c = seen_from_blade(x);
  if (rounding.on_borders) c = on_border(c, rounding.near);
  const double inside = inside_by(c);
  // On the other side it matters whether it is over the plate: there are ways round other borders too.
  if (side * c.n < 0) found.lead = std::min(found.lead, std::abs(inside));
  if (!(inside > 0)) {
    const Local near = nearest_on_plate(c), away = {c.u - near.u, c.n, c.w - near.w};
    const double distance = length_of(away);
    if (distance >= clearance_) return {};
    if (distance == 0) return turned_back({0, side * clearance_, 0});
    return (clearance_ / distance - 1) * turned_back(away);
  }
  const double height = side * c.n;
  if (height >= clearance_) return {};
  const Local back = {0, side * clearance_ - c.n, 0};
  if (height >= 0) return turned_back(back);
  // It came through the plate: back, or round one of the four sides, where the rounded rim has to be cleared too.
  const double beyond = -side * std::max(-height, clearance_) - c.n;
  const std::array<Local, kWaysOffPlate> ways = {back, Local{0, beyond, -c.w}, Local{0, beyond, depth_ - c.w},
                                                 Local{-half_length_ - c.u, beyond, 0},
                                                 Local{half_length_ - c.u, beyond, 0}};
  std::array<double, kWaysOffPlate> lengths;
  std::transform(ways.begin(), ways.end(), lengths.begin(), length_of);
  const auto shortest = std::min_element(lengths.begin(), lengths.end());
  for (auto length = lengths.begin(); length != lengths.end(); ++length) {
    if (length != shortest) found.lead = std::min(found.lead, *length - *shortest);
  }
  const auto preferred = at(rounding.preferred_way);
  const bool is_as_short = lengths[preferred] <= *shortest + rounding.near;
  return turned_back(ways[is_as_short ? preferred : at(shortest - lengths.begin())]);
}

Vec3 Contact::off_walls(Vec3 x) const {
  for (const Wall& wall : walls_) {
    if (wall.side * (x[wall.axis] - wall.offset) < 0) x[wall.axis] = wall.offset;
  }
  return x;
}

Vec3 Contact::projected(Vec3 x, int side, Found& found, const Rounding& rounding) const {
  if (!has_plate_) return off_walls(x);
  Vec3 now = x + way_off_plate(x, side, found, rounding);
  bool by_plate = !(now == x);
  for (int turn = 0; turn < kTurns; ++turn) {
    const Vec3 inside = off_walls(now);
    if (inside == now) break;
    Vec3 from = inside;
    if (rounding.between_turns != nullptr) from += rounding.near * rounding.between_turns->vector();
    now = from + way_off_plate(from, side, found, rounding);
    by_plate = by_plate || !(now == from);
    found.in_turn = found.in_turn || by_plate;
    if (now == from) return inside;
  }
  return now;
}

// Reduces the tangential part of `slid` along a surface with this normal by at most `most`.
Vec3 Contact::rubbed(Vec3 x, Vec3 slid, Vec3 normal, double most, Found& found) {
  const Vec3 tangential = slid - dot(slid, normal) * normal;
  const double length = norm(tangential);
  if (length > most) return x - (most / length) * tangential;
  found.hold = std::min(found.hold, most - length);
  return x - tangential;
}

Vec3 Contact::place(Vec3 free, int side, Vec3 start, Found& found, const Rounding& rounding) const {
  Vec3 x = projected(free, side, found, rounding);
  if (x == free && !found.in_turn) return x;
  // Walls alone, each as deep as that; or the blade alone. Both in turn hold nothing firmly.
  found.hold = found.in_turn ? 0 : norm(x - free);
  for (const Wall& wall : walls_) {
    const double pressed = wall.side * (wall.offset - free[wall.axis]);
    if (pressed <= 0) continue;
    found.hold = std::min(found.hold, pressed);
    if (wall.friction == 0) continue;
    Vec3 normal;
    normal[wall.axis] = 1;
    x = rubbed(x, x - start, normal, wall.friction * pressed, found);
  }
  if (!has_friction()) return x;
  if (has_plate_ && blade_friction_ > 0) {
    const Vec3 way = way_off_plate(free, side, found, rounding);
    if (const double pressed = norm(way); pressed > 0) {
      // It slides against the blade's own point beneath it.
      const Local c = seen_from_blade(x);
      const Vec3 was = from_.edge + c.u * from_.along + c.w * from_.back + c.n * cross(from_.along, from_.back);
      x = rubbed(x, was - start, way / pressed, blade_friction_ * pressed, found);
    }
  }
  const Vec3 end = projected(x, side, found, rounding);
  // Friction may have taken it near to the rim. The last turn leads it out to the clearance, and multiplies a rounding
  // by the ratio of both distances: by two or more where half the clearance is left of the way.
  if (!has_plate_ || rounding.between_turns == nullptr || norm(end - x) < clearance_ / 2) return end;
  return projected(x + rounding.near * rounding.between_turns->vector(), side, found, rounding);
}

Vec3 Contact::origin_of(Vec3 seen, Vec3 free) const {
  if (!has_plate_) return free;
  const Vec3 foot = to_.edge + turned_back(nearest_on_plate(seen_from_blade(seen))), way = seen - foot;
  const double squared = dot(way, way);
  // The foot itself has no direction.
  return foot + (squared > 0 ? std::clamp(dot(free - foot, way) / squared, 1e-9, 1.0) : 1.0) * way;
}

}  // namespace cutproof::oracles
