// Places that blade and walls allow one particle within one substep (method.md §3), implemented independently of any
// backend. Internal to oracles/.
#pragma once
#include <limits>
#include <vector>

#include "model/setup.h"
#include "oracles/blade_motion.h"
#include "oracles/noise.h"

namespace cutproof::oracles {

class Contact {
 public:
  // `move`: the blade's motion in this substep, or nullptr. `walls`: the setup's, exact or with rounding. Keeps a
  // reference to them.
  Contact(const Setup& setup, const BladeMove* move, const std::vector<Wall>& walls);

  bool any() const { return has_plate_ || !walls_.empty(); }
  bool has_plate() const { return has_plate_; }
  bool has_friction() const { return wall_friction_ > 0 || blade_friction_ > 0; }
  // Lipschitz constant of place() in `free`, away from the rim of the plate: friction moves a particle by up to μ times
  // its depth, so each surface with friction multiplies by 1 + μ.
  double widened_by_friction() const { return (1 + wall_friction_) * (1 + blade_friction_); }
  // Friction, or room that is not convex.
  bool path_matters() const { return has_plate_ || has_friction(); }

  // Over the plane of the blade where the substep begins [m].
  double height_at_start(Vec3 start) const;
  // On which side of it a particle ends, +1 or -1; 0 where it does not end over the plate, by `rim` at least [m], or
  // ends less than half a clearance from it.
  int side_of_end(Vec3 x, double rim) const;
  // Rounding of a contact at x, in units of u [m]. It is 6 times the distance from the blade's edge plus that of the
  // edge from the origin, or the greatest offset of a wall if that is more.
  double rounds(Vec3 x) const;

  // Depth of x in the places forbidden for a particle of this side [m]; not above 0: x is allowed. Beside a border of
  // the plate, `least` and `most` are those of all places within `near` of x.
  struct Depth {
    double least, most;
  };
  Depth depth(Vec3 x, int side, double near) const;

  // What rounds where blade and walls act in turn, and may double with each turn. Either each place between turns is
  // off, or a place that is as near to a border of the plate lies on the border to the bit: nothing leads it sideways.
  // Of ways off the plate that are equally long within rounding, any may be the shortest.
  struct Rounding {
    double near = 0;  // [m]
    Noise* between_turns = nullptr;
    bool on_borders = false;
    int preferred_way = 0;  // of kWaysOffPlate
  };
  static constexpr int kWaysOffPlate = 5;  // back to the particle's side, or round one of four borders

  // How a place was found.
  struct Found {
    bool in_turn = false;  // blade and walls have both moved it
    // By how much, at least, the way off the plate was shorter than every other one, or a particle on the other side
    // was from a border; and how far it was, at least, from where a contact that holds it would have let go [m].
    double lead = std::numeric_limits<double>::infinity(), hold = std::numeric_limits<double>::infinity();
  };
  // Where one is put that would go to `free`.
  Vec3 place(Vec3 free, int side, Vec3 start, Found& found, const Rounding& rounding) const;

  // A place that blade and walls have made in turn is refused if it is farther from `free` than `present` is, by more
  // than this [m].
  static double refusal_margin(double stored, Vec3 free, Vec3 present, double unit_roundoff) {
    return kRefusalRoundings * unit_roundoff * (norm(present - free) + stored);
  }

  // A place that the blade alone would have led to `seen`: of all of them the one nearest to `free`. Beside the rim a
  // way is short and its direction rounds; this undoes it.
  Vec3 origin_of(Vec3 seen, Vec3 free) const;

 private:
  Local seen_from_blade(Vec3 x) const { return to_local(to_, x - to_.edge); }
  Vec3 turned_back(Local c) const;
  double inside_by(Local c) const;  // how far it is over the plate, from the nearest of its borders
  Local nearest_on_plate(Local c) const;
  Local on_border(Local c, double near) const;
  Vec3 way_off_plate(Vec3 x, int side, Found& found, const Rounding& rounding) const;
  Vec3 off_walls(Vec3 x) const;
  Vec3 projected(Vec3 x, int side, Found& found, const Rounding& rounding) const;
  static Vec3 rubbed(Vec3 x, Vec3 slid, Vec3 normal, double most, Found& found);

  const std::vector<Wall>& walls_;
  bool has_plate_ = false;
  BladePose from_, to_;
  double half_length_ = 0, depth_ = 0, clearance_ = 0, blade_friction_ = 0, wall_friction_ = 0;
};

}  // namespace cutproof::oracles
