#include "baselines/fem/fem_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_fem_cuda(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<fem::Kernels<Device>>(scene, parameters);
}

}  // namespace cutproof::baselines
