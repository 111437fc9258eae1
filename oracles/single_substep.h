// One substep taken out of a schedule.
#pragma once
#include "model/setup.h"

namespace cutproof::oracles {

// The first substep of `frame` as a scene of its own: one frame of one substep. Requires 0 <= frame < frame_count().
Setup single_substep_setup(const Setup& setup, int64_t frame);

}  // namespace cutproof::oracles
