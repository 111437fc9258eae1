#include "baselines/mpm/mpm_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_mpm_host(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<mpm_kernels::Program<Host>>(scene, parameters);
}

}  // namespace cutproof::baselines
