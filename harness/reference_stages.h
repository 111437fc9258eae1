// The reference's stages, for comparisons: oracles/ must not depend on the reference.
#pragma once
#include "oracles/comparison/stage_comparison.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

inline oracles::ReferenceStages reference_stages() {
  return {reference::step, reference::detect, reference::split, reference::merge, reference::expand, reference::skin};
}

}  // namespace cutproof::harness
