// The kernels on the host.
#include "baselines/tets/tets_kernels.h"

namespace cutproof::baselines {

std::unique_ptr<Simulator> make_tets_host(const Scene& scene, const Parameters& parameters) {
  return std::make_unique<tets::Kernels<Host>>(scene, parameters);
}

}  // namespace cutproof::baselines
