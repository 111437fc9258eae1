// The reference as a plugin: what it offers and promises.
#include "reference_kernels.h"

namespace {

#ifndef PLUGIN_ONLY_STAGES
#define PLUGIN_ONLY_STAGES false
#endif

#ifdef PLUGIN_SPANS
#ifndef PLUGIN_FIRST
#define PLUGIN_FIRST first
#endif
// Spans of so many stages, from PLUGIN_FIRST on if that is given.
int can_run(int first, int last) { return first == PLUGIN_FIRST && last - first + 1 == PLUGIN_SPANS ? 1 : 0; }
#endif

const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "the reference",
    .version = "1",
#ifdef PLUGIN_PROMISES
    .promises = PLUGIN_PROMISES,
#endif
    .device = CUTPROOF_HOST,
    .real = PLUGIN_REAL,
    .create = reference_plugin::create,
    .destroy = reference_plugin::destroy,
    .rotations = PLUGIN_ONLY_STAGES ? nullptr : reference_plugin::rotations,
    .surface = PLUGIN_ONLY_STAGES ? nullptr : reference_plugin::surface,
#ifdef PLUGIN_SPANS
    .can_run = can_run,
#endif
    .load = reference_plugin::load,
    .run = reference_plugin::run,
};

}  // namespace

CUTPROOF_PLUGIN(plugin)
