// The cheapest configuration of a scene whose error is within a tolerance (measuring.md, Tuning).
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "harness/backends.h"
#include "model/scene.h"
#include "tuning/reference_solution.h"

namespace cutproof::tuning {

struct TuneOptions {
  std::string scene;  // its file
  std::string write;  // where the scene that is found is written
  harness::BackendChoice backend;
  double tolerance = 0;                            // [h]
  ReferenceKind reference = ReferenceKind::limit;  // what errors are distances from
  std::optional<int64_t> frames;                   // looks at so many of the scene's only
  bool without_skin = false;                       // nobody looks at it
  bool full = false;                               // nothing is given up: errors and times of all that is tried
  int repeats = 3;                                 // timed runs of a configuration
};

// What has just been added to the document; the last four conclude.
enum class TuneStep {
  begun,
  reference_known,
  trial,
  searched,
  not_taken,  // a trial that was cheaper and does not hold
  found,
  reference_unknown,  // the reference solution is not known well enough to say
  none_within,
  none_verified  // of those that seemed to be within
};
// `so_far`: the fields of results_schema.md. `given`: the scene that is tuned.
using TuneProgress = std::function<void(TuneStep step, const nlohmann::json& so_far, const Scene& given)>;

// Writes the scene that is found, and returns whether one is. Throws InputError for a scene, a backend or an option
// that cannot be tuned, MachineError if the machine fails.
bool run_tune(const TuneOptions& options, const TuneProgress& progress);

}  // namespace cutproof::tuning
