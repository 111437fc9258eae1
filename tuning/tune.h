// The cheapest configuration of a scene whose error is within a tolerance (measure_and_tune.md, Tuning).
#pragma once
#include <functional>
#include <nlohmann/json.hpp>

#include "tuning/measurement.h"

namespace cutproof::tuning {

// The addition to the document; the last five conclude.
enum class TuneStep {
  begun,
  reference_known,
  trial,
  tried,  // all; with `full` possible points of the front are timed next
  searched,
  not_taken,  // a cheaper trial that does not hold
  found,
  reference_unknown,  // the reference solution is not known well enough for an answer
  none_within,
  none_verified,  // of those within the tolerance
  stopped         // on request before the end: the document stays incomplete
};
// `so_far`: the fields of docs/reference/schemas/tune.json. `given`: the tuned scene, built as `built` says.
using TuneProgress = std::function<void(TuneStep step, const nlohmann::json& so_far, const Scene& given,
                                        const fixtures::BuildReport& built)>;

// Called after a trial: the approximate share of the search that is done, in [0, 1].
double part_searched(const nlohmann::json& so_far, const Scene& given);

// Writes the found scene, and returns whether there is one. Throws InputError for a scene, a backend or an option that
// cannot be tuned, MachineError if the machine fails.
bool run_tune(const TuneOptions& options, const TuneProgress& progress);

}  // namespace cutproof::tuning
