// The cheapest configuration of a scene whose error is within a tolerance (guide.md, Tuning).
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/provenance.h"
#include "harness/backends.h"
#include "tuning/measurement.h"
#include "tuning/reference_solution.h"
#include "tuning/trial.h"
#include "tuning/verification.h"

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

struct TuneResult {
  enum class Conclusion {
    found,
    reference_unknown,  // the reference solution is not known well enough to say
    none_within,
    none_verified  // of those that seemed to be within
  };
  struct NotTaken {
    std::size_t trial;
    std::string why;
  };
  struct Found {
    std::size_t trial = 0;
    std::string text;  // of the scene
    Verified verified;
    TimedInTurns times;
  };

  benchmarks::Provenance provenance;
  TuneOptions options;
  Configuration given;
  bool skin_is_expected = false;        // so it is made, though nobody looks at it
  std::vector<RefinementLevel> levels;  // of the reference solution; the last is what is verified against
  std::size_t searched_level = 0;       // from which trials are measured
  double known_to_h = 0;                // by how much the reference solution may be off
  std::vector<Trial> trials;            // in the order in which they were tried, the first as given
  std::vector<NotTaken> not_taken;      // cheaper, but they do not hold
  std::optional<Found> found;
  std::optional<Conclusion> conclusion;  // absent before the end
};
nlohmann::json to_json(const TuneResult& result);
// `limit` or `substeps`.
const char* name_of(ReferenceKind kind);

// What has just been added to a result.
enum class TuneStep { begun, reference_known, trial, searched, not_taken, concluded };
using TuneProgress = std::function<void(const TuneResult& so_far, TuneStep step)>;

// Writes the scene that is found. Throws InputError for a scene, a backend or an option that cannot be tuned,
// MachineError if the machine fails.
TuneResult run_tune(const TuneOptions& options, const TuneProgress& progress);

}  // namespace cutproof::tuning
