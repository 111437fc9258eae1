#include "oracles/single_substep.h"

#include <utility>

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

Setup first_substeps(const Setup& setup, int64_t frame, int32_t count) {
  Setup first = setup;
  first.step.substeps = count;
  first.substep_length = {setup.substep_length[at(frame)]};
  first.stroke_end.clear();
  const auto begin = static_cast<std::ptrdiff_t>(frame * setup.step.substeps);
  const auto cut = [&](auto& values) {
    if (values.empty()) return;
    values.erase(values.begin() + begin + count, values.end());
    values.erase(values.begin(), values.begin() + begin);
  };
  cut(first.blade_moves);
  for (Grip& grip : first.grips) {
    cut(grip.active);
    cut(grip.displacement);
  }
  return first;
}

Setup step_alone(Setup setup) {
  if (setup.detect.criterion == Criterion::geometric) {
    setup.has_blade = false;
    setup.blade_moves.clear();
  }
  setup.stroke_end.clear();
  remove_nothing(setup.detect);
  setup.skin.wanted = false;
  return setup;
}

Setup undisturbed(Setup setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.walls.clear();
  setup.grips.clear();
  return step_alone(std::move(setup));
}

}  // namespace cutproof::oracles
