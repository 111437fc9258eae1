// Where the blade and the walls let one particle be within one substep (method.md §3, Blade; decisions.md, Contacts
// with the blade), written a second time: no line is shared with a backend. Internal to oracles/.
#pragma once
#include "model/setup.h"
#include "oracles/blade_motion.h"
#include "oracles/step_model/decisions.h"
#include "oracles/step_model/noise.h"

namespace cutproof::oracles {

// How much ways into the blade's frame and back round, in units of u times the distance from its edge.
inline constexpr double kContactRounds = 4;

class ContactModel {
 public:
  // `move`: what the blade does in this substep; nullptr: none, or it is up. `walls` may differ from the setup's by a
  // rounding, as may the move. What is as `near` to the blade's plane, or to where its rectangle ends [of its distance
  // from the edge], is where the numbers say, or on it to the bit; or if it is near to both, it is led off the rim in
  // any direction.
  enum class Border : uint8_t { as_it_is, exact, any };
  // `turns`: rounds between turns of blade and walls, as the arithmetic of that unit roundoff does; nullptr: exact.
  ContactModel(const Setup& setup, const BladeMove* move, const std::vector<Wall>& walls,
               Border border = Border::as_it_is, double near = 0, Noise* turns = nullptr, double unit_roundoff = 0);

  bool any() const { return plate_ || !walls_.empty(); }
  bool has_plate() const { return plate_; }
  bool has_friction() const { return friction_; }
  // Friction, or room that is not convex.
  bool path_matters() const { return plate_ || friction_; }

  // Over the plane of the blade at the start of the substep [m]; its sign is the particle's side.
  double height_at_start(Vec3 start) const;

  // One particle in one substep: where it began, and how high over the blade's plane.
  struct Began {
    Vec3 start;
    double height = 0;
    double angle = 0;  // to the plane, under which it is led off the rim if that is open [rad]
    Vec3 origin;       // of what a backend stores of its places
  };

  // Where a particle is that has a place already.
  struct Present {
    Vec3 x;
    double stored = 0;         // the length of what a backend stores of it [m]
    double unit_roundoff = 0;  // the backend's
    double raised = 0;         // set: by how much the square of its distance from where it would go has grown [m²]
  };

  // Where one may be that would go to `free`; it does not go where that is worse than where it is (nullptr: the
  // prediction, which comes from nowhere). `hold`: falls to how far, at least, `free` is from where a contact that
  // holds would let go [m]; nullptr: nobody asks.
  Vec3 place(Vec3 free, const Began& began, Present* present, Decisions& decisions, double* hold = nullptr) const;

  // Whether blade and walls both move one that would go to `free`, in turn: its place need not be the nearest one then.
  bool acts_in_turn(Vec3 free, const Began& began, Decisions& decisions) const;

  // By how much one that would go to `free` is inside of what it may not enter [m]; <= 0: it stays there.
  double depth(Vec3 free, const Began& began, Decisions& decisions) const;

 private:
  Vec3 way_off_plate(Vec3 x, const Began& began, Decisions& decisions) const;
  Vec3 off_plate(Vec3 x, const Began& began, Decisions& decisions) const;
  Vec3 off_walls(Vec3 x) const;
  Vec3 nearest(Vec3 x, const Began& began, Decisions& decisions, bool* in_turn = nullptr) const;
  Vec3 rounded(Vec3 x, const Began& began) const;
  int side_of(const Began& began, Decisions& decisions) const;
  struct OnBorder {
    Local place;
    Local out;  // unit vector in the plane, away from the rectangle; 0: not on the rim
  };
  OnBorder seen_from_blade(Vec3 x) const;
  Vec3 turned_back(Local c) const;

  const std::vector<Wall>& walls_;
  bool plate_ = false, friction_ = false;
  BladePose from_, to_;
  double half_length_ = 0, depth_ = 0, clearance_ = 0, blade_friction_ = 0, near_ = 0;
  Border border_ = Border::as_it_is;
  Noise* turns_ = nullptr;
  double unit_roundoff_ = 0;
};

}  // namespace cutproof::oracles
