#include "gpu/launch/load.h"

#include <utility>

namespace cutproof::gpu {

Load::Load(std::vector<Setup> bodies, const std::vector<State>& states, const KernelOptions& options, Capacity with)
    : setups(std::move(bodies)),
      capacity(with),
      staging(make_contents(setups, states, options.rotation_method, with)),
      plan(make_plan(setups, states, options.rotation_method, options.split)) {
  forget_skins();
}

Load Load::enlarged(const std::vector<State>& states, const KernelOptions& options) {
  return Load(std::move(setups), states, options, Capacity{2 * capacity.factor});
}

}  // namespace cutproof::gpu
