// The kernels on a CUDA device.
#include "baselines/tets/tets_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_tets_cuda(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<tets::Kernels<Device>>(scene, parameters);
}

}  // namespace cutproof::baselines
