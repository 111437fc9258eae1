// Contacts of one particle with the blade and the walls within one substep (method.md §3).
#pragma once
#include "model/setup.h"

namespace cutproof::reference {

// What a particle may not enter during one substep is fixed when the substep begins, so that projecting is the exact
// minimum of an energy that does not change between iterations.
class Contacts {
 public:
  // `move` is what the blade does in this substep; nullptr if there is none or if it is up.
  Contacts(const Setup& setup, const BladeMove* move);

  // The side of the blade (+1 or -1) on which a particle at x stands when the substep begins; +1 on a tie.
  int side(Vec3 x) const;

  // The allowed point nearest to x, without friction, of a particle that began on side `side`. Exact for the walls
  // alone and for the blade alone; where both hold at once they are projected in turn, the blade last.
  // `in_turn`, if wanted, is set where both have moved it.
  Vec3 project(Vec3 x, int side, bool* in_turn = nullptr) const;

  // The same with friction: `start` is where the particle was when the substep began.
  Vec3 project_with_friction(Vec3 x, int side, Vec3 start, bool* in_turn = nullptr) const;

  // The same for a solver that comes from x and would go to `free`. Where blade and walls both move it, in turn, that
  // need not give the nearest point; one that is farther from `free` than x is not taken, so that the energy cannot
  // grow. Elsewhere the projection is exact, and asking would only let rounding decide.
  Vec3 next_position(Vec3 free, int side, Vec3 start, Vec3 x) const;

  // Whether a particle at x that began on side `side` touches a contact, or nearly so (kTouchMargin).
  bool touches(Vec3 x, int side) const;

  bool any() const { return has_blade_ || !setup_.walls.empty(); }
  bool frictionless() const { return frictionless_; }
  // Friction, or room that is not convex: an iteration can have several fixed points.
  bool path_matters() const { return has_blade_ || !frictionless_; }

 private:
  struct Frame {
    Vec3 edge, along, back, normal;
    Vec3 local(Vec3 x) const { return {dot(x - edge, along), dot(x - edge, back), dot(x - edge, normal)}; }
    Vec3 direction(Vec3 c) const { return c.x * along + c.y * back + c.z * normal; }
    Vec3 global(Vec3 c) const { return edge + direction(c); }
  };
  static Frame frame_of(const BladePose& pose);
  Vec3 project_on_walls(Vec3 x) const;
  // What leads off the blade, zero where nothing has to. Not the difference of two positions, which would have no
  // direction where it is short.
  Vec3 way_off_blade(Vec3 x, int side) const;
  Vec3 project_on_blade(Vec3 x, int side) const;
  Vec3 way_round_a_side(Vec3 c, int side) const;  // in the blade's frame
  // In the blade's frame: whether a point is over the mid-surface, and the nearest point of that.
  bool is_over(Vec3 c) const;
  Vec3 nearest_on_blade(Vec3 c) const;

  const Setup& setup_;
  bool has_blade_ = false;
  bool frictionless_ = true;
  Frame from_, to_;
  double half_length_ = 0, depth_ = 0, clearance_ = 0;
};

}  // namespace cutproof::reference
