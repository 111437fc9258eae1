#include "baselines/plugin.h"
#include "baselines/tets/tets.h"

namespace cutproof::baselines {

const Method kMethod = {"tets_" BASELINES_TEXT(PROGRAM), "free deterministic no_ghost_force mirror",
                        "cells diagonals cut_resolution=0.5", tets_parameters, BASELINES_JOINED(make_tets_, PROGRAM)};

}  // namespace cutproof::baselines
