#include "oracles/step_model/contact_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cutproof::oracles {
namespace {

// How often blade and walls are projected in turn where both hold (decisions.md, Contacts with the blade).
constexpr int kTurns = 16;

// Takes back at most `most` of what `slid` has along a surface. `hold`: falls to what is left of that.
Vec3 held_back(Vec3 x, Vec3 slid, Vec3 normal, double most, double& hold) {
  const Vec3 tangential = slid - dot(slid, normal) * normal;
  const double length = norm(tangential);
  if (length <= most) hold = std::min(hold, most - length);
  return length > most ? x - (most / length) * tangential : x - tangential;
}

}  // namespace

ContactModel::ContactModel(const Setup& setup, const BladeMove* move, const std::vector<Wall>& walls, Border border,
                           double near, Noise* turns, double unit_roundoff)
    : walls_(walls), near_(near), border_(border), turns_(turns), unit_roundoff_(unit_roundoff) {
  friction_ = std::any_of(walls.begin(), walls.end(), [](const Wall& wall) { return wall.friction > 0; });
  plate_ = move != nullptr && setup.detect.criterion != Criterion::geometric;
  if (!plate_) return;
  from_ = move->from;
  to_ = move->to;
  half_length_ = setup.blade.length / 2;
  depth_ = setup.blade.depth;
  clearance_ = blade_clearance(setup);
  blade_friction_ = setup.blade.friction;
  friction_ = friction_ || blade_friction_ > 0;
}

double ContactModel::height_at_start(Vec3 start) const {
  if (!plate_) return 1;
  const Local c = to_local(from_, start - from_.edge);
  return border_ == Border::exact && std::abs(c.n) <= near_ * std::hypot(c.u, c.n, c.w) ? 0 : c.n;
}

int ContactModel::side_of(const Began& began, Decisions& decisions) const {
  return decisions.exceeds(DecisionKind::side, -began.height) ? -1 : +1;
}

// On a border a place is special: nothing leads off it sideways, while a rounding beside it is led this way or that,
// and farther each time; and beside the rim no more than rounding says where that leads.
ContactModel::OnBorder ContactModel::seen_from_blade(Vec3 x) const {
  OnBorder seen = {to_local(to_, x - to_.edge), {}};
  if (border_ == Border::as_it_is) return seen;
  Local& c = seen.place;
  const double near = near_ * std::hypot(c.u, c.n, c.w);
  const double beyond_end = std::abs(c.u) - half_length_;
  const bool at_edge = std::abs(c.w) <= near, at_back = std::abs(c.w - depth_) <= near,
             at_end = std::abs(beyond_end) <= near;
  const bool within = beyond_end <= near && c.w >= -near && c.w <= depth_ + near;
  if (border_ == Border::exact) {
    if (std::abs(c.n) <= near) c.n = 0;
    if (at_edge) c.w = 0;
    if (at_back) c.w = depth_;
    if (at_end) c.u = std::copysign(half_length_, c.u);
  } else if (std::abs(c.n) <= near && within && (at_edge || at_back || at_end)) {
    seen.out = {at_end ? std::copysign(1.0, c.u) : 0, 0, at_edge ? -1.0 : at_back ? 1.0 : 0};
    const double length = std::hypot(seen.out.u, seen.out.w);
    seen.out.u /= length;
    seen.out.w /= length;
  }
  return seen;
}

Vec3 ContactModel::turned_back(Local c) const {
  return c.u * to_.along + c.w * to_.back + c.n * cross(to_.along, to_.back);
}

Vec3 ContactModel::off_walls(Vec3 x) const {
  for (const Wall& wall : walls_) {
    const double inside = wall.side * (wall.offset - x[wall.axis]);
    if (inside > 0) x[wall.axis] = wall.offset;
  }
  return x;
}

// Forbidden is what is nearer than ρ to the rectangle, and what lies over it on the side where the particle did not
// begin.
Vec3 ContactModel::way_off_plate(Vec3 x, const Began& began, Decisions& decisions) const {
  const OnBorder seen = seen_from_blade(x);
  const Local& c = seen.place;
  if (seen.out.u != 0 || seen.out.w != 0) {
    const double outwards = clearance_ * std::abs(std::sin(began.angle));
    return turned_back({outwards * seen.out.u, clearance_ * std::cos(began.angle), outwards * seen.out.w});
  }
  const double before_edge = -c.w, behind_back = c.w - depth_, beyond_end = std::abs(c.u) - half_length_;
  const double outside = std::max({before_edge, behind_back, beyond_end});  // of the rectangle; below 0: over it
  if (outside > decisions.near() && std::max(outside, std::abs(c.n)) >= clearance_) return {};
  if (outside <= decisions.near()) {
    const int side = side_of(began, decisions);
    const double height = side * c.n;
    if (outside < 0 && height >= clearance_) return {};
    const Local lift = {0, side * clearance_ - c.n, 0};
    if (outside < 0 && height >= 0) return turned_back(lift);
    if (height < 0) {
      // It came through the plate: back, or round one of the four sides, where the rounded rim has to be cleared too.
      // Just beyond a side it is round that one already; near a corner, rounding may lead it round another.
      const double far = std::max(-height, clearance_), climb = far + height;
      const std::array<double, 5> ways = {clearance_ - height, std::hypot(std::max(-before_edge, 0.0), climb),
                                          std::hypot(std::max(-behind_back, 0.0), climb),
                                          std::hypot(std::max(-beyond_end, 0.0), climb),
                                          std::hypot(half_length_ + std::abs(c.u), climb)};
      const int way = decisions.least(DecisionKind::way_out, ways);
      const bool is_round =
          (way == 1 && before_edge >= 0) || (way == 2 && behind_back >= 0) || (way == 3 && beyond_end >= 0);
      if (way == 0) return turned_back(lift);
      Local out = {0, -side * far - c.n, 0};
      if (way == 1) out.w = -c.w;
      if (way == 2) out.w = depth_ - c.w;
      if (way == 3) out.u = std::copysign(half_length_, c.u) - c.u;
      if (way == 4) out.u = -std::copysign(half_length_, c.u) - c.u;
      if (!is_round) return turned_back(out);
    }
  }
  const Local on_plate = {std::clamp(c.u, -half_length_, half_length_), 0, std::clamp(c.w, 0.0, depth_)};
  const Local away = {c.u - on_plate.u, c.n, c.w - on_plate.w};
  const double distance = std::hypot(away.u, away.n, away.w);
  if (distance >= clearance_) return {};
  if (distance == 0) return turned_back({0, side_of(began, decisions) * clearance_, 0});
  const double more = clearance_ / distance - 1;
  return turned_back({more * away.u, more * away.n, more * away.w});
}

Vec3 ContactModel::off_plate(Vec3 x, const Began& began, Decisions& decisions) const {
  return x + way_off_plate(x, began, decisions);
}

// What is led from one to the other and back may be led farther each time, beginning with a rounding: twice as far in
// each turn is 65,000 times as far in the end.
Vec3 ContactModel::rounded(Vec3 x, const Began& began) const {
  if (turns_ == nullptr || !plate_) return x;
  return x + turns_->off(unit_roundoff_ * (x - began.origin), kContactRounds * unit_roundoff_ * norm(x - to_.edge));
}

// `in_turn`: blade and walls have both moved it, so that this need not be the nearest point.
Vec3 ContactModel::nearest(Vec3 x, const Began& began, Decisions& decisions, bool* in_turn) const {
  if (!plate_) return off_walls(x);
  Vec3 present = off_plate(x, began, decisions);
  bool by_plate = !(present == x);
  for (int turn = 0; turn < kTurns; ++turn) {
    const Vec3 above = off_walls(present);
    if (above == present) break;
    const Vec3 from = rounded(above, began), way = way_off_plate(from, began, decisions);
    const bool moves = !(way == Vec3{});
    present = moves ? from + way : above;
    by_plate = by_plate || moves;
    if (in_turn != nullptr && by_plate) *in_turn = true;
    if (!moves) break;
  }
  return present;
}

bool ContactModel::acts_in_turn(Vec3 free, const Began& began, Decisions& decisions) const {
  bool in_turn = false;
  nearest(free, began, decisions, &in_turn);
  return in_turn;
}

double ContactModel::depth(Vec3 free, const Began& began, Decisions& decisions) const {
  double deepest = -std::numeric_limits<double>::infinity();
  for (const Wall& wall : walls_) deepest = std::max(deepest, wall.side * (wall.offset - free[wall.axis]));
  if (!plate_) return deepest;
  const Local c = to_local(to_, free - to_.edge);
  if (std::abs(c.u) < half_length_ && c.w > 0 && c.w < depth_) {
    return std::max(deepest, clearance_ - side_of(began, decisions) * c.n);
  }
  const double away =
      std::hypot(c.u - std::clamp(c.u, -half_length_, half_length_), c.n, c.w - std::clamp(c.w, 0.0, depth_));
  return std::max(deepest, clearance_ - away);
}

Vec3 ContactModel::place(Vec3 free, const Began& began, Present* present, Decisions& decisions, double* hold) const {
  bool in_turn = false;
  Vec3 placed = nearest(free, began, decisions, &in_turn);
  double least = std::numeric_limits<double>::infinity();
  if (hold != nullptr && !(placed == free)) {
    // Walls alone, each as deep as that; or the blade alone. (Both: in turn, which holds nothing firmly.)
    least = norm(placed - free);
    for (const Wall& wall : walls_) {
      const double pressed = wall.side * (wall.offset - free[wall.axis]);
      if (pressed > 0) least = std::min(least, pressed);
    }
  }
  if (friction_ && (in_turn || !(placed == free))) {
    for (const Wall& wall : walls_) {
      const double pressed = wall.side * (wall.offset - free[wall.axis]);
      if (!(pressed > 0) || wall.friction == 0) continue;
      Vec3 normal;
      normal[wall.axis] = 1;
      placed = held_back(placed, placed - began.start, normal, wall.friction * pressed, least);
    }
    const Vec3 pushed = blade_friction_ > 0 ? way_off_plate(free, began, decisions) : Vec3{};
    const double pressed = norm(pushed);
    if (pressed > 0) {
      // Against the point of the blade that is under the particle, which has moved too.
      const Local c = to_local(to_, placed - to_.edge);
      const Vec3 was = from_.edge + c.u * from_.along + c.w * from_.back + c.n * cross(from_.along, from_.back);
      const Vec3 blade_moved = placed - was;
      placed =
          held_back(placed, placed - began.start - blade_moved, pushed / pressed, blade_friction_ * pressed, least);
    }
    placed = nearest(rounded(placed, began), began, decisions, &in_turn);
  }
  if (hold != nullptr) *hold = in_turn ? 0 : std::min(*hold, least);
  // Never what is worse than the present place, but for rounding, so that the energy cannot grow: only where turns were
  // taken.
  if (in_turn && !friction_ && present != nullptr) {
    const double there = norm(placed - free), here = norm(present->x - free);
    const double margin = kRefusalRoundings * present->unit_roundoff * (here + present->stored);
    const std::array<double, 2> costs = {there, here + margin};
    if (decisions.least(DecisionKind::refused, costs) == 1) return present->x;
    present->raised = std::max(0.0, there * there - here * here);
  }
  return placed;
}

}  // namespace cutproof::oracles
