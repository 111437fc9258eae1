#include "baselines/fem/fem.h"
#include "baselines/plugin.h"

namespace cutproof::baselines {

const Method kMethod = {"fem_" BASELINES_TEXT(PROGRAM), "free deterministic no_ghost_force mirror",
                        "cells cut_resolution=1",
                        [](const char* text) {
                          Parameters parameters(text, fem::known_parameters());
                          fem::settings_of(parameters, 1);
                          return parameters;
                        },
                        BASELINES_JOINED(make_fem_, PROGRAM)};

}  // namespace cutproof::baselines
