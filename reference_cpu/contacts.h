// Contacts of one particle with the blade and the walls within one substep (method.md §3).
#pragma once
#include "model/setup.h"

namespace cutproof::reference {

// The forbidden set is fixed when the substep begins. So projecting is the exact minimum of an energy that does not
// change between iterations.
class Contacts {
 public:
  // `move`: the blade's move in this substep; nullptr if there is no blade or it is raised.
  Contacts(const Setup& setup, const BladeMove* move);

  // The side of the blade (+1 or -1) of a particle at x when the substep begins; +1 on a tie.
  int side(Vec3 x) const;

  // The allowed point nearest to x, without friction, for a particle that began on side `side`. Exact for walls alone
  // and for the blade alone. Where both act, projections alternate, the blade last, and `in_turn` (optional) is set if
  // both moved the particle.
  Vec3 project(Vec3 x, int side, bool* in_turn = nullptr) const;

  // With friction. `start`: the particle's position when the substep began.
  Vec3 project_with_friction(Vec3 x, int side, Vec3 start, bool* in_turn = nullptr) const;

  // For a solver that moves the particle from x towards `free`. Alternating projections need not give the nearest
  // point. A point farther from `free` than x is rejected, so the energy cannot grow. An exact projection needs no such
  // test, which rounding would decide.
  Vec3 next_position(Vec3 free, int side, Vec3 start, Vec3 x) const;

  // Whether a particle at x that began on side `side` touches a contact, or nearly so (kTouchMargin).
  bool touches(Vec3 x, int side) const;

  bool any() const { return has_blade_ || !setup_.walls.empty(); }
  bool frictionless() const { return frictionless_; }
  // With friction or a non-convex allowed set an iteration can have several fixed points.
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
  // Displacement off the blade, zero if none is needed. A difference of two positions would lose its direction where it
  // is short.
  Vec3 way_off_blade(Vec3 x, int side) const;
  Vec3 project_on_blade(Vec3 x, int side) const;
  Vec3 way_round_a_side(Vec3 c, int side) const;  // in the blade's frame
  // In the blade's frame. is_over: the point lies straight above or below the mid-surface.
  bool is_over(Vec3 c) const;
  Vec3 nearest_on_blade(Vec3 c) const;

  const Setup& setup_;
  bool has_blade_ = false;
  bool frictionless_ = true;
  Frame from_, to_;
  double half_length_ = 0, depth_ = 0, clearance_ = 0;
};

}  // namespace cutproof::reference
