// The kernels on the host.
#include "baselines/tets/tets.h"
namespace cutproof::baselines {
std::unique_ptr<Simulator> make_tets_host(const Scene& scene, const Parameters& parameters) {
  return make_tets_cpu(scene, parameters);
}
}  // namespace cutproof::baselines
