// How far a step moved the body, held against the velocities and impulses that the states name.
#pragma once
#include "model/setup.h"
#include "model/state.h"
#include "model/verdict.h"

namespace cutproof::oracles {

// Positions and velocities before and after the step of one frame belong together (method.md §3; bounds:
// docs/tolerances.md, Motion). What can be said of it without running the step again:
// - one substep a frame: each particle has moved by dt v' / D, with D = e^(−c dt);
// - a particle that a grip holds throughout has followed the grip's path, and one that it holds in the last substep has
//   the path's velocity;
// - along each axis in which no contact can push, the centre of mass has moved as momentum and gravity say; along one
// in
//   which contacts push to one side only, by what the frame's impulse can add at its latest and at its earliest.
// `measured` and `bound` are those of the comparison that comes nearest to its bound or goes farthest beyond [h].
// Vacuous where none of these can be asked: a blade that is down, friction or a grip may push to any side.
Verdict motion(const Setup& setup, const State& before, const State& after);

}  // namespace cutproof::oracles
