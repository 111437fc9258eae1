// The plugins mpm_cpu, mpm_host and mpm_cuda: PROGRAM says which program answers.
#include <exception>
#include <new>
#include <string_view>

#include "baselines/mpm/mpm.h"

#define MPM_WORDS_(word) #word
#define MPM_WORDS(word) MPM_WORDS_(word)
#define MPM_JOINED_(a, b) a##b
#define MPM_JOINED(a, b) MPM_JOINED_(a, b)

namespace {

using namespace cutproof::baselines;

constexpr std::string_view kProgram = MPM_WORDS(PROGRAM);

void* create(const cutproof_host* host, const char* text) {
  try {
    auto parameters = std::make_unique<Parameters>(text, mpm::known_parameters());
    mpm::require_in_range(*parameters);
#ifdef BASELINES_HAVE_CUDA
    if constexpr (kProgram == "cuda") mpm::require_device();
#endif
    return parameters.release();
  } catch (const std::exception& error) {
    host->log(host, error.what());
    return nullptr;
  }
}

void destroy(void* self) { delete static_cast<Parameters*>(self); }

int answer(const cutproof_host* host, void* self, const cutproof_scene* asked, cutproof_frames* run) {
  try {
    const Scene scene = scene_of(*asked);
    const auto simulator = MPM_JOINED(make_mpm_, PROGRAM)(scene, *static_cast<Parameters*>(self));
    return dissect(*simulator, scene, host, run);
  } catch (const std::bad_alloc&) {
    host->log(host, "there is not enough memory for this scene; give a smaller one");
  } catch (const std::exception& error) {
    host->log(host, error.what());
  }
  return 1;
}

const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "mpm_" MPM_WORDS(PROGRAM),
    .version = "1",
    .promises = "free angular_momentum deterministic no_ghost_force mirror",
    .device = CUTPROOF_HOST,
    .real = kProgram == "cpu" ? CUTPROOF_F64 : CUTPROOF_F32,
    .create = create,
    .destroy = destroy,
    // Of two plates nearer than a cell of the grid, no node would lie between, and what is there would be cut off.
    .limits = "gap=2",
    .dissect = answer,
};

}  // namespace

CUTPROOF_PLUGIN(plugin)
