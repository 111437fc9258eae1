// How far separated pieces stand in each other. Figures, not verdicts: measure_and_tune.md, Geometry
// says what they mean.
#pragma once
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// Space that is inside the skins of two or more components of G [h³]: every line of a lattice parallel to an axis, at
// most h / kColumnsPerSpacing apart, knows exactly how much of it is. `bound`: how far the volume may be from the
// truth, for the axis where this is least (docs/design/tolerances.md, Interpenetration).
inline constexpr int kColumnsPerSpacing = 8;
// Not a number if the skin is broken.
struct Interpenetration {
  double volume = 0, bound = 0;
};
Interpenetration interpenetration(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
