// The demand of the strain criterion on each particle (method.md §4). Internal to oracles/.
#pragma once
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/demand.h"

namespace cutproof::oracles {

struct StrainDemand {
  Demand demand = Demand::keep;
  double stretch = 0;  // greatest principal stretch of a cluster that holds it
};
// [n] Requires a well-formed state, that before the stage.
std::vector<StrainDemand> demands_of_strain(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
