#include "baselines/fem/fem_kernels.h"

namespace cutproof::baselines {

template class fem::Kernels<Host>;

std::unique_ptr<Simulator> make_fem_host(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<fem::Kernels<Host>>(scene, parameters);
}

}  // namespace cutproof::baselines
