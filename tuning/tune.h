// The cheapest configuration of a scene whose error is within a tolerance (measure_and_tune.md, Tuning).
#pragma once
#include <functional>
#include <nlohmann/json.hpp>

#include "tuning/measurement.h"

namespace cutproof::tuning {

// What has just been added to the document; the last five conclude.
enum class TuneStep {
  begun,
  reference_known,
  trial,
  tried,  // all; with `full` what may be a point of the front is timed next
  searched,
  not_taken,  // a trial that was cheaper and does not hold
  found,
  reference_unknown,  // the reference solution is not known well enough to say
  none_within,
  none_verified,  // of those that seemed to be within
  stopped         // before its end, as it was asked to: the document stays incomplete
};
// `so_far`: the fields of docs/reference/schemas/tune.json. `given`: the scene that is tuned, and `built` how it was
// built.
using TuneProgress = std::function<void(TuneStep step, const nlohmann::json& so_far, const Scene& given,
                                        const fixtures::BuildReport& built)>;

// After a trial: about how much of the search is done, in [0, 1].
double part_searched(const nlohmann::json& so_far, const Scene& given);

// Writes the scene that is found, and returns whether one is. Throws InputError for a scene, a backend or an option
// that cannot be tuned, MachineError if the machine fails.
bool run_tune(const TuneOptions& options, const TuneProgress& progress);

}  // namespace cutproof::tuning
