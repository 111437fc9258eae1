#include "baselines/fem/fem.h"
#include "baselines/parallel.h"
namespace cutproof::baselines {
std::unique_ptr<Simulator> make_fem_host(const Scene& scene, const Parameters& parameters) {
  return make_fem_cpu(scene, parameters);
}
}  // namespace cutproof::baselines
