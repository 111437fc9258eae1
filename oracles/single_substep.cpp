#include "oracles/single_substep.h"

#include "oracles/support.h"

namespace cutproof::oracles {

Setup single_substep_setup(const Setup& setup, int64_t frame) {
  const auto first = at(frame * setup.step.substeps);
  Setup single = setup;
  single.step.substeps = 1;
  single.substep_length = {setup.substep_length[at(frame)]};
  single.stroke_end.clear();
  if (!setup.blade_moves.empty()) single.blade_moves = {setup.blade_moves[first]};
  for (Grip& grip : single.grips) {
    grip.active = {grip.active[first]};
    grip.displacement = {grip.displacement[first]};
  }
  return single;
}

}  // namespace cutproof::oracles
