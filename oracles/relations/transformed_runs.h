// A scene and the same one transformed, both run, and compared up to rounding and ties. Internal to oracles/relations/.
#pragma once
#include <string>

#include "oracles/relations/shared.h"
#include "oracles/relations/transformed_scene.h"

namespace cutproof::oracles {

// splitmix64 (Steele, Lea and Flood 2014).
uint64_t mixed(uint64_t& seed);

// Decisions, clusters and skin vertices exactly, numbers up to rounding (tolerances.md, A transformed scene).
// Requires that the backend can run the span. `how`: in the witness; `seed`: of the disturbances that show how
// sensitive the scene is.
void judge_transformed(Verdict& verdict, const std::string& how, Backend& backend, const Setup& setup,
                       const State& state, const TransformedScene& scene, const State& transformed_state, Span span,
                       uint64_t seed);

}  // namespace cutproof::oracles
