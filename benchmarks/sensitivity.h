// The smallest disturbance that the judge of runs rejects, beside the rounding of correct code.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/scene.h"
#include "harness/moments.h"
#include "harness/property_summary.h"
#include "model/backend.h"
#include "model/stop.h"
#include "oracles/comparison/stage_comparison.h"

namespace cutproof::benchmarks {

inline constexpr double kLeastSize = 1e-15, kGreatestSize = 1e2;

// A change by a size in `unit`. A disturbance of a state applies to the result of a stage. Any other applies to the
// scene and to the state before the step, from which a simulator then runs.
struct Disturbance {
  std::string name, unit;
  std::function<void(const Setup& setup, State& state, double size)> of_state = {};
  // Returns whether there was something to change.
  std::function<bool(Setup& setup, State& before, double size)> of_run = {};
  // The rounding of correct code in the same unit; empty where no comparison measures it.
  std::function<double(const oracles::StageDifference& found)> rounding = {};
  // Size that should be rejected, where it is no multiple of rounding.
  std::optional<double> goal = {};
  double greatest = kGreatestSize;  // tried; beyond half a turn a rotation comes back
};
// Of the middle particle, cluster or vertex of its list: position, velocity, impulse, rotation, mass, rest center, skin
// vertex. Of the run: gravity, stiffness, friction, impulse between pieces.
const std::vector<Disturbance>& disturbances();

// Goal of disturbances of states, in roundings of correct code.
inline constexpr double kRoundingsAllowed = 10;

// A kept run and its verdicts without a disturbance.
struct KeptRun {
  harness::Trace trace;
  harness::PropertySummaries properties;
  std::vector<Verdict> failed;
};
// Throws Stopped between two of its moments, here and below, if requested.
KeptRun keep_run(Backend& backend, const ReadyScene& scene, const StopAsked& stop_asked = {});

// At most `count` moments, evenly over those in which only this stage was due.
std::vector<harness::Moment> moments_of(const Setup& setup, const harness::Trace& trace, Stage stage, int64_t count);

struct Sensitivity {
  int64_t moments = 0;             // with something to change
  std::optional<double> least;     // rejected in a moment; empty if nothing was, up to the greatest size
  std::string property;            // that rejects it, the first in the order of verdicts
  std::optional<double> rounding;  // greatest over the same moments
};
// Bisects down to 5 % of the size, as if every size above a rejected one were rejected too.
Sensitivity least_rejected(Backend& backend, const Setup& setup, const Disturbance& disturbance, Stage stage,
                           const std::vector<harness::Moment>& moments, const StopAsked& stop_asked = {});

}  // namespace cutproof::benchmarks
