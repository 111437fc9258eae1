// The cost of a configuration on a backend, and its distance from the reference solution.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/prepared_scene.h"
#include "harness/backends.h"
#include "model/io/scene_io.h"
#include "model/stop.h"
#include "tuning/reference_solution.h"
#include "tuning/trial.h"

namespace cutproof::tuning {

struct TuneOptions {
  std::string scene;                     // its file
  std::vector<io::SceneChange> changes;  // of the scene; the changed scene is tuned
  std::string write;                     // where the found scene is written
  harness::BackendChoice backend;
  double tolerance = 0;                            // [h]
  ReferenceKind reference = ReferenceKind::limit;  // errors are distances from it
  std::optional<int64_t> frames;                   // looks at the scene's first frames only
  bool without_skin = false;                       // it is not needed
  bool full = false;                               // completes all trials: errors and times
  int repeats = 3;       // timed runs of a configuration; with `full` of possible points of the front
  StopAsked stop_asked;  // ends it between two frames
};

// A measurement's subject and method. `asked` must outlive it.
struct Measuring {
  const TuneOptions& asked;
  Configuration given;
  fixtures::BuildReport built = {};  // of the given scene

  // The tolerance less the reference solution's own error.
  double allowed(const ReferenceSolution& reference) const { return asked.tolerance - reference.known_to_h(); }
  std::unique_ptr<Backend> make_backend() const;
};

// `limit`: the seconds per frame beyond which the trial may be given up as too expensive. `before`: earlier trials.
// With `full` it is timed as often as the search needs; fronts use times_in_turns().
Trial measure(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
              std::optional<double> limit, const std::vector<Trial>& before);

// Seconds per frame of each, `repeats` runs in turns with the others. Measured anew, because the least of many figures
// is biased.
std::vector<benchmarks::Times> times_in_turns(const Measuring& measuring,
                                              const std::vector<Configuration>& configurations);

}  // namespace cutproof::tuning
