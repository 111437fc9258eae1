#include "property_tests/touching.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/at.h"

namespace cutproof::property_tests {
namespace {

// [h] A particle placed at a distance is there up to rounding, also in single precision; chance rarely places one so
// near.
constexpr double kTouching = 1e-4, kExactly = 1e-5;
// A particle led round a side stands right over it, at most this far from the plane; beyond, it is there by chance [ρ].
constexpr double kFarthestLed = 3;
// [h] of one substep, along a surface: it stuck; it slid, and a neighbour would have taken others along.
constexpr double kStuck = 1e-5, kSlid = 1e-4;

// In the axes of the blade: u along the cutting edge, w from it to the back, n along the normal.
struct BladeCoordinates {
  double u = 0, w = 0, n = 0;
};
BladeCoordinates in_blade(const BladePose& pose, Vec3 x) {
  const Vec3 d = x - pose.edge;
  return {dot(d, pose.along), dot(d, pose.back), dot(d, cross(pose.along, pose.back))};
}

// How far a particle has moved along a surface in the last substep [m].
double slid_along(const Wall& wall, Vec3 moved) {
  moved[wall.axis] = 0;
  return norm(moved);
}
double slid_along(const BladeMove& move, Vec3 x, Vec3 moved) {
  const BladeCoordinates from = in_blade(move.from, x - moved), to = in_blade(move.to, x);
  return std::hypot(to.u - from.u, to.w - from.w);
}

class Looker {
 public:
  Looker(const Setup& setup, const State& before, const State& after)
      : setup_(setup), before_(before), after_(after), h_(setup.body.grid.spacing) {
    const auto last = at((before.frame + 1) * setup.step.substeps - 1);
    const double dt = setup.substep_length[at(before.frame)];
    // v = exp(-c dt) (x - x_prev) / dt
    to_moved_ = dt * std::exp(setup.step.damping * dt);
    held_.assign(after.x.size(), 0);
    std::vector<uint8_t> let_go(after.x.size(), 0);  // by some grip
    for (const Grip& grip : setup.grips) {
      const bool was = std::any_of(grip.active.begin(), grip.active.begin() + static_cast<std::ptrdiff_t>(last),
                                   [](uint8_t active) { return active != 0; });
      for (const int32_t i : grip.particles) {
        if (grip.active[last] != 0) held_[at(i)] = 1;
        if (grip.active[last] == 0 && was) let_go[at(i)] = 1;
      }
    }
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!before.alive[i]) continue;
      seen_.held |= held_[i] != 0;
      seen_.released |= held_[i] == 0 && let_go[i] != 0;
      seen_.taken_over |= held_[i] != 0 && let_go[i] != 0;
    }
    const bool blade_touches = setup.has_blade && setup.detect.criterion != Criterion::geometric;
    if (blade_touches && setup.blade_moves[last].down) move_ = &setup.blade_moves[last];
  }

  Touches look() {
    for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
      if (!before_.alive[at(i)] || held_[at(i)] != 0) continue;
      const bool at_blade = move_ != nullptr && look_at_blade(i);
      bool at_wall = false;
      for (const Wall& wall : setup_.walls) at_wall |= look_at_wall(wall, i);
      seen_.blade_and_wall |= at_blade && at_wall;
    }
    return seen_;
  }

 private:
  Vec3 moved(int32_t i) const { return to_moved_ * after_.v[at(i)]; }

  template <class Slid>
  void look_at_friction(int32_t i, const Slid& slid) {
    const double own = slid(i);
    seen_.slides |= own > kSlid * h_;
    if (!(own <= kStuck * h_)) return;
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = setup_.body.neighbour(i, direction);
      seen_.sticks |= other >= 0 && before_.alive[at(other)] && slid(other) > kSlid * h_;
    }
  }

  bool look_at_wall(const Wall& wall, int32_t i) {
    if (!(std::abs(after_.x[at(i)][wall.axis] - wall.offset) <= kExactly * h_)) return false;
    seen_.wall = true;
    seen_.wall_that_is_no_floor |= wall.axis != 2 || wall.side < 0;
    if (wall.friction > 0) look_at_friction(i, [&](int32_t k) { return slid_along(wall, moved(k)); });
    return true;
  }

  bool look_at_blade(int32_t i) {
    const Blade& blade = setup_.blade;
    const BladeCoordinates c = in_blade(move_->to, after_.x[at(i)]);
    const double half = blade.length / 2, clearance = blade_clearance(setup_);
    const double over_side = std::abs(c.u) - half, over_edge = -c.w, over_back = c.w - blade.depth;
    const double beyond = std::hypot(std::max(over_side, 0.0), std::max({over_edge, over_back, 0.0}));
    const double near = kTouching * h_;
    const double border = std::max({over_side, over_edge, over_back});
    const bool over = border <= near;
    const bool led = over && border >= -kExactly * h_ && std::abs(c.n) >= clearance - near &&
                     std::abs(c.n) <= kFarthestLed * clearance;
    const bool touches = std::abs(std::hypot(beyond, c.n) - clearance) <= near;
    if (!touches && !led) return false;
    seen_.blade_face |= over && touches;
    seen_.blade_rim |= beyond > near;
    seen_.blade_side |= over_side >= -near;
    seen_.cutting_edge |= over_edge >= -near;
    seen_.blade_back |= over_back >= -near;
    if (border >= -kExactly * h_ && beyond <= kExactly * h_) {
      seen_.on_a_border = true;
      const int64_t first = before_.frame * setup_.step.substeps;
      seen_.led_round |= c.n * in_blade(setup_.blade_moves[at(first)].from, before_.x[at(i)]).n < 0;
    }
    if (blade.friction > 0 && beyond <= near) {
      look_at_friction(i, [&](int32_t k) { return slid_along(*move_, after_.x[at(k)], moved(k)); });
    }
    return true;
  }

  const Setup& setup_;
  const State &before_, &after_;
  double h_, to_moved_ = 0;
  const BladeMove* move_ = nullptr;  // of the last substep, if the blade is there
  std::vector<uint8_t> held_;
  Touches seen_;
};

}  // namespace

Touches touches_of(const Setup& setup, const State& before, const State& after) {
  return Looker(setup, before, after).look();
}

}  // namespace cutproof::property_tests
