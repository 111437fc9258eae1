#include "baselines/mpm/mpm.h"
#include "baselines/plugin.h"

namespace cutproof::baselines {

const Method kMethod = {"mpm_" BASELINES_TEXT(PROGRAM), "free angular_momentum deterministic no_ghost_force mirror",
                        // Of two plates nearer than a cell of the grid, no node would lie between: tissue there would
                        // be coupled to nothing.
                        "gap=2",
                        [](const char* text) {
                          Parameters parameters(text, mpm::known_parameters());
                          mpm::require_in_range(parameters);
                          return parameters;
                        },
                        BASELINES_JOINED(make_mpm_, PROGRAM)};

}  // namespace cutproof::baselines
