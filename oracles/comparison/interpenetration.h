// Interpenetration of separated pieces. Figures, not verdicts (measure_and_tune.md, Geometry).
#pragma once
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// Volume inside the skins of two or more components of G [h³], integrated exactly along lines parallel to an axis, at
// most h / kColumnsPerSpacing apart. `bound`: greatest error of the volume, for the axis where it is least
// (docs/design/tolerances.md, Interpenetration).
inline constexpr int kColumnsPerSpacing = 8;
// Not a number if the skin is broken.
struct Interpenetration {
  double volume = 0, bound = 0;
};
Interpenetration interpenetration(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
