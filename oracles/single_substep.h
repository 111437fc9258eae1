// Setups made from another: one substep taken out of its schedule; nothing that acts from outside.
#pragma once
#include "model/setup.h"

namespace cutproof::oracles {

// The same body in one frame of one substep. take_substep() fills it in: its schedule is that of substep `substep`,
// counted within `frame`, of `setup`. Requires 0 <= frame < frame_count().
Setup frame_of_one_substep(const Setup& setup);
void take_substep(const Setup& setup, int64_t frame, int64_t substep, Setup& single);

// Both for the first substep of a frame: a scene of its own.
Setup single_substep_setup(const Setup& setup, int64_t frame);

// A frame cut to its first `count` substeps: a scene of its own. Requires as above, and 0 < count <= substeps.
Setup first_substeps(const Setup& setup, int64_t frame, int32_t count);

// Frames of which nothing but the step acts: nothing is removed, and there is no skin. A geometric blade touches
// nothing, so it goes.
Setup step_alone(Setup setup);

// Nothing acts from outside: no blade, walls, grips; nothing is removed, and there is no skin.
Setup undisturbed(Setup setup);

}  // namespace cutproof::oracles
