#include "baselines/mpm/mpm_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_mpm_cuda(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<mpm_kernels::Program<Device>>(scene, parameters);
}

}  // namespace cutproof::baselines
