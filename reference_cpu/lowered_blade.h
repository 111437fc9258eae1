// The plane that separates the two sides of a cut for detection and skin. Internal to reference_cpu/.
#pragma once
#include "model/at.h"
#include "model/setup.h"

namespace cutproof::reference {

// The last pose in which the blade was lowered in a frame; null if it never was, or if the schedule is over.
inline const BladePose* lowered_blade(const Setup& setup, int64_t frame) {
  const BladePose* pose = nullptr;
  const bool scheduled = setup.has_blade && frame < setup.frame_count();
  for (int32_t s = 0; scheduled && s < setup.step.substeps; ++s) {
    const BladeMove& move = setup.blade_moves[at(frame * setup.step.substeps + s)];
    if (move.down) pose = &move.to;
  }
  return pose;
}

}  // namespace cutproof::reference
