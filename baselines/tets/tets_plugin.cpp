// One source for the plugins tets_cpu, tets_host and tets_cuda: PROGRAM is cpu, host or cuda.
#include <exception>

#include "baselines/tets/tets.h"
#include "cutproof/plugin.h"

#define TETS_JOINED(a, b) a##b
#define TETS_MAKE(program) TETS_JOINED(make_tets_, program)
#define TETS_TEXT_OF(word) #word
#define TETS_NAME(program) "tets_" TETS_TEXT_OF(program)

namespace {

using cutproof::baselines::Parameters;

constexpr char kProgram = TETS_NAME(PROGRAM)[6];  // cpu, host, cuda: p, o, u
constexpr bool kIsDouble = kProgram == 'p', kIsOnDevice = kProgram == 'u';

// Runs a function of the plugin. No exception may leave it.
template <class Result, class Function>
Result guarded(const cutproof_host* host, Result if_it_fails, Function function) {
  try {
    return function();
  } catch (const std::bad_alloc&) {
    host->log(host, "there is not enough memory for this scene; give a smaller one");
  } catch (const std::exception& error) {
    host->log(host, error.what());
  }
  return if_it_fails;
}

void* create(const cutproof_host* host, const char* text) {
  return guarded<void*>(host, nullptr, [&]() -> void* {
#ifdef BASELINES_HAVE_CUDA
    if (kIsOnDevice && !cutproof::baselines::has_tets_device()) {
      host->log(host, "there is no CUDA device; use the plugin tets_host");
      return nullptr;
    }
#endif
    return new Parameters(cutproof::baselines::tets_parameters(text));
  });
}

void destroy(void* self) { delete static_cast<Parameters*>(self); }

int dissect(const cutproof_host* host, void* self, const cutproof_scene* asked, cutproof_frames* run) {
  return guarded(host, 1, [&] {
    const cutproof::baselines::Scene scene = cutproof::baselines::scene_of(*asked);
    const auto simulator = cutproof::baselines::TETS_MAKE(PROGRAM)(scene, *static_cast<const Parameters*>(self));
    return cutproof::baselines::dissect(*simulator, scene, host, run);
  });
}

cutproof_plugin plugin_of_tets() {
  cutproof_plugin plugin = {};
  plugin.size = sizeof plugin;
  plugin.abi = CUTPROOF_ABI;
  plugin.name = TETS_NAME(PROGRAM);
  plugin.version = "1";
  plugin.promises = "free deterministic no_ghost_force mirror";
  plugin.device = CUTPROOF_HOST;
  plugin.real = kIsDouble ? CUTPROOF_F64 : CUTPROOF_F32;
  plugin.limits = "cells diagonals cut_resolution=0.5";
  plugin.create = create;
  plugin.destroy = destroy;
  plugin.dissect = dissect;
  return plugin;
}

const cutproof_plugin kPlugin = plugin_of_tets();

}  // namespace

extern "C" CUTPROOF_PLUGIN(kPlugin)
