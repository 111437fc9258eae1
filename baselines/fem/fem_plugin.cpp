// The plugins fem_cpu, fem_host and fem_cuda. PROGRAM: cpu, host or cuda.
#include <exception>
#include <new>
#include <string_view>

#include "baselines/fem/fem.h"

#define FEM_JOIN(a, b) a##b
#define FEM_MAKE(program) FEM_JOIN(baselines::make_fem_, program)
#define FEM_TEXT(program) #program
#define FEM_NAME(program) "fem_" FEM_TEXT(program)

namespace {

namespace baselines = cutproof::baselines;

constexpr std::string_view kName = FEM_NAME(PROGRAM);

// The host's log gets what was thrown.
template <class Work>
auto logged(const cutproof_host* host, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    host->log(host, "memory does not suffice for this scene; take a smaller one, or refine it less");
  } catch (const std::exception& error) {
    host->log(host, error.what());
  }
  return {};
}

void* create(const cutproof_host* host, const char* text) {
  return logged(host, [&]() -> baselines::Parameters* {
    auto parameters = std::make_unique<baselines::Parameters>(text, baselines::fem::known_parameters());
    baselines::fem::settings_of(*parameters, 1);
    if (kName == "fem_cuda") FEM_MAKE(PROGRAM)({}, *parameters);  // throws where there is no device
    return parameters.release();
  });
}

void destroy(void* self) { delete static_cast<baselines::Parameters*>(self); }

int dissect(const cutproof_host* host, void* self, const cutproof_scene* asked, cutproof_frames* run) {
  const bool is_done = logged(host, [&] {
    const baselines::Scene scene = baselines::scene_of(*asked);
    const auto simulator = FEM_MAKE(PROGRAM)(scene, *static_cast<const baselines::Parameters*>(self));
    return baselines::dissect(*simulator, scene, host, run) == 0;
  });
  return is_done ? 0 : 1;
}

const cutproof_plugin kPlugin = {.size = sizeof kPlugin,
                                 .abi = CUTPROOF_ABI,
                                 .name = kName.data(),
                                 .version = "1",
                                 .promises = "free deterministic no_ghost_force mirror",
                                 .device = CUTPROOF_HOST,
                                 .real = kName == "fem_cpu" ? CUTPROOF_F64 : CUTPROOF_F32,
                                 .create = create,
                                 .destroy = destroy,
                                 .limits = "cells cut_resolution=1",
                                 .dissect = dissect};

}  // namespace

CUTPROOF_PLUGIN(kPlugin)
