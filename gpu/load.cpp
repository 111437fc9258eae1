#include "gpu/load.h"

#include <utility>

namespace cutproof::gpu {

Load::Load(std::vector<Setup> bodies, const std::vector<State>& states, const KernelOptions& options, Capacity with)
    : setups(std::move(bodies)),
      capacity(with),
      staging(make_contents(setups, states, with)),
      plan(make_plan(setups, states, options.split)) {
  forget_skins();
}

Load Load::enlarged(const std::vector<State>& states, const KernelOptions& options) {
  Load larger(std::move(setups), states, options, Capacity{2 * capacity.factor});
  // A state has only the sum of its particles' impulses; distributing the sum over particles would round anew.
  larger.staging.impulse = std::move(staging.impulse);
  return larger;
}

}  // namespace cutproof::gpu
