// How small a disturbance the judge of runs still rejects, beside what correct code is off by.
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

// Something that is changed by a size in `unit`. Of a state it is put on what a stage left; else on what a simulator
// takes for the scene and the state before its step, which it then runs.
struct Disturbance {
  std::string name, unit;
  std::function<void(const Setup& setup, State& state, double size)> of_state = {};
  // Whether there was something to change.
  std::function<bool(Setup& setup, State& before, double size)> of_run = {};
  // What correct code is off by in the same unit; nothing where no comparison measures that.
  std::function<double(const oracles::StageDifference& found)> rounding = {};
  // Least that should be rejected, where that is no multiple of rounding.
  std::optional<double> goal = {};
  double greatest = kGreatestSize;  // that is tried; beyond half a turn a rotation comes back
};
// Of one particle, cluster or vertex, the one in the middle of its list: position, velocity, impulse, rotation, mass,
// rest center, skin vertex. Of the run: gravity, stiffness, friction, impulse between pieces.
const std::vector<Disturbance>& disturbances();

// Of a disturbance of state: this many times what correct code is off by.
inline constexpr double kRoundingsAllowed = 10;

// A run that was kept, and what the judge says of it as it is.
struct KeptRun {
  harness::Trace trace;
  harness::PropertySummaries properties;
  std::vector<Verdict> failed;
};
// Throws Stopped between two of its moments, here and below, if that is asked.
KeptRun keep_run(Backend& backend, const ReadyScene& scene, const StopAsked& stop_asked = {});

// At most `count` moments, evenly over those in which this stage alone was due.
std::vector<harness::Moment> moments_of(const Setup& setup, const harness::Trace& trace, Stage stage, int64_t count);

struct Sensitivity {
  int64_t moments = 0;  // in which there was something to change
  std::optional<double>
      least;  // rejected in one of the moments or more; nothing if nothing was, up to the greatest that is tried
  std::string property;            // that rejects it, the first in the order of verdicts
  std::optional<double> rounding;  // greatest over the same moments
};
// Bisects, as if all that is greater than a size that is rejected were rejected too, up to 5 % of the size.
Sensitivity least_rejected(Backend& backend, const Setup& setup, const Disturbance& disturbance, Stage stage,
                           const std::vector<harness::Moment>& moments, const StopAsked& stop_asked = {});

}  // namespace cutproof::benchmarks
