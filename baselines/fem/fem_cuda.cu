// nvcc says of Eigen's defaulted functions that their annotations are ignored.
#pragma nv_diag_suppress 20012
#include "baselines/fem/fem_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_fem_cuda(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<fem::Kernels<Device>>(scene, parameters);
}

}  // namespace cutproof::baselines
