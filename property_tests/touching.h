// Contacts of a step of a moving body: computed from the states around the step and from the setup, so that coverage
// does not depend on a backend's word.
#pragma once
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::property_tests {

// Each: whether there is such a particle when the last substep of the frame ends.
struct Touches {
  // The plate of the blade is rounded: touching particles are at the distance ρ from its rectangle (model/setup.h).
  bool blade_face = false;    // over the rectangle
  bool blade_rim = false;     // beyond a side of the rectangle, nearer to its plane than ρ
  bool blade_side = false;    // beyond one of the two sides along the depth, or right over it
  bool cutting_edge = false;  // the same of the cutting edge
  bool blade_back = false;    // the same of the back
  bool on_a_border = false;   // exactly over one of the four, up to rounding
  bool led_round = false;     // there, and it began the frame on the other side of the blade
  bool wall = false;          // stands at a wall
  bool wall_that_is_no_floor = false;
  bool blade_and_wall = false;  // one particle touches both
  // On a surface with friction: the particle moved along it in the last substep, or it did not though a neighbour did.
  bool slides = false, sticks = false;
  bool held = false;        // by a grip
  bool released = false;    // not held now, but in an earlier substep of the run
  bool taken_over = false;  // held by one grip now, by another in an earlier substep
};

// `before` and `after`: around the step of frame before.frame.
Touches touches_of(const Setup& setup, const State& before, const State& after);

}  // namespace cutproof::property_tests
