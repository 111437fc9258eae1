// Internal to oracles/comparison/.
#pragma once
#include <algorithm>

#include "oracles/oracles.h"

namespace cutproof::oracles {

// Whether positions and velocities can be compared with others at all.
inline bool measurable(const Setup& setup, const State& state) {
  return well_formed(setup, state).holds && std::all_of(state.x.begin(), state.x.end(), is_finite) &&
         std::all_of(state.v.begin(), state.v.end(), is_finite);
}

}  // namespace cutproof::oracles
