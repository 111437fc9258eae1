// External forces on a body in one frame. Internal to oracles/.
#pragma once
#include <algorithm>
#include <array>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/support.h"

namespace cutproof::oracles {

// Contacts that may push along an axis in one frame.
enum class Pushes { none, up, down, any };

inline bool holds_in(const Setup& setup, const Grip& grip, int64_t frame) {
  const auto first = grip.active.begin() + frame * setup.step.substeps;
  return std::any_of(first, first + setup.step.substeps, [](auto active) { return active != 0; });
}

// On particles that no grip holds.
inline std::array<Pushes, 3> pushes_on_free(const Setup& setup, const State& before) {
  const int64_t substeps = setup.step.substeps, first = before.frame * substeps;
  bool any = false;
  for (int64_t s = first; s < first + substeps; ++s) any = any || (setup.has_blade && setup.blade_moves[at(s)].down);
  // Accelerated iterations weigh earlier pushes negatively, so that their sum may have any sign.
  any = any || (!setup.walls.empty() && setup.step.acceleration != Acceleration::none);
  std::array<Pushes, 3> pushes = {Pushes::none, Pushes::none, Pushes::none};
  for (const Wall& wall : setup.walls) {
    for (int axis = 0; axis < 3; ++axis) {
      Pushes& present = pushes[at(axis)];
      const Pushes more = axis != wall.axis ? (wall.friction > 0 ? Pushes::any : Pushes::none)
                          : wall.side > 0   ? Pushes::up
                                            : Pushes::down;
      if (more == Pushes::none) continue;
      present = present == Pushes::none || present == more ? more : Pushes::any;
    }
  }
  if (any) pushes.fill(Pushes::any);
  return pushes;
}

// On the whole body.
inline std::array<Pushes, 3> pushes_of(const Setup& setup, const State& before) {
  std::array<Pushes, 3> pushes = pushes_on_free(setup, before);
  for (const Grip& grip : setup.grips) {
    if (!grip.particles.empty() && holds_in(setup, grip, before.frame)) pushes.fill(Pushes::any);
  }
  return pushes;
}

}  // namespace cutproof::oracles
