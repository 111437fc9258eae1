#include "oracles/single_substep.h"

#include "oracles/support.h"

namespace cutproof::oracles {

Setup frame_of_one_substep(const Setup& setup) {
  Setup single = setup;
  single.step.substeps = 1;
  single.substep_length.assign(1, 0);
  single.stroke_end.clear();
  single.blade_moves.resize(setup.blade_moves.empty() ? 0 : 1);
  for (Grip& grip : single.grips) {
    grip.active.assign(1, 0);
    grip.displacement.assign(1, {});
  }
  return single;
}

void take_substep(const Setup& setup, int64_t frame, int64_t substep, Setup& single) {
  const auto index = at(frame * setup.step.substeps + substep);
  single.substep_length[0] = setup.substep_length[at(frame)];
  if (!single.blade_moves.empty()) single.blade_moves[0] = setup.blade_moves[index];
  for (std::size_t g = 0; g < setup.grips.size(); ++g) {
    single.grips[g].active[0] = setup.grips[g].active[index];
    single.grips[g].displacement[0] = setup.grips[g].displacement[index];
  }
}

Setup single_substep_setup(const Setup& setup, int64_t frame) {
  Setup single = frame_of_one_substep(setup);
  take_substep(setup, frame, 0, single);
  return single;
}

Setup undisturbed(Setup setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.stroke_end.clear();
  setup.walls.clear();
  setup.grips.clear();
  remove_nothing(setup.detect);
  setup.skin.wanted = false;
  return setup;
}

}  // namespace cutproof::oracles
