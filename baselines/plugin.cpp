#include "baselines/plugin.h"

#include <exception>
#include <new>
#include <stdexcept>
#include <string_view>

namespace {

namespace baselines = cutproof::baselines;

constexpr std::string_view kProgram = BASELINES_TEXT(PROGRAM);

void* create(const cutproof_host* host, const char* text) {
  try {
    auto parameters = std::make_unique<baselines::Parameters>(baselines::kMethod.read(text));
#ifdef BASELINES_HAVE_CUDA
    if (kProgram == "cuda") baselines::require_device();
#endif
    return parameters.release();
  } catch (const std::invalid_argument& error) {
    if (CUTPROOF_HAS(host, refuse_parameters)) host->refuse_parameters(host, error.what());
  } catch (const std::exception& error) {
    host->log(host, error.what());
  }
  return nullptr;
}

void destroy(void* self) { delete static_cast<baselines::Parameters*>(self); }

int dissect(const cutproof_host* host, void* self, const cutproof_scene* asked, cutproof_frames* run) {
  try {
    const baselines::Scene scene = baselines::scene_of(*asked);
    const auto simulator = baselines::kMethod.make(scene, *static_cast<const baselines::Parameters*>(self));
    return baselines::dissect(*simulator, scene, host, run);
  } catch (const std::bad_alloc&) {
    host->log(host, "there is not enough memory for this scene; give a smaller one");
  } catch (const std::exception& error) {
    host->log(host, error.what());
  }
  return 1;
}

const cutproof_plugin kPlugin = {.size = sizeof kPlugin,
                                 .abi = CUTPROOF_ABI,
                                 .name = baselines::kMethod.name,
                                 .version = "1",
                                 .promises = baselines::kMethod.promises,
                                 .device = CUTPROOF_HOST,
                                 .real = kProgram == "cpu" ? CUTPROOF_F64 : CUTPROOF_F32,
                                 .create = create,
                                 .destroy = destroy,
                                 .limits = baselines::kMethod.limits,
                                 .dissect = dissect};

}  // namespace

CUTPROOF_PLUGIN(kPlugin)
