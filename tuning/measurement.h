// What a configuration of a scene costs on a backend, and how far it is from the reference solution.
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
  std::vector<io::SceneChange> changes;  // of it: what is tuned is the scene with these
  std::string write;                     // where the scene that is found is written
  harness::BackendChoice backend;
  double tolerance = 0;                            // [h]
  ReferenceKind reference = ReferenceKind::limit;  // what errors are distances from
  std::optional<int64_t> frames;                   // looks at so many of the scene's only
  bool without_skin = false;                       // nobody looks at it
  bool full = false;                               // nothing is given up: errors and times of all that is tried
  int repeats = 3;       // timed runs of a configuration; with `full` of those that may be points of the front
  StopAsked stop_asked;  // ends it between two frames
};

// What is measured, and how. `asked` must outlive it.
struct Measuring {
  const TuneOptions& asked;
  Configuration given;
  fixtures::BuildReport built = {};  // of what was given

  // What is left of the tolerance where the reference solution is not known better.
  double allowed(const ReferenceSolution& reference) const { return asked.tolerance - reference.known_to_h(); }
  std::unique_ptr<Backend> make_backend() const;
};

// `limit`: the seconds per frame beyond which it may be given up as too expensive. `before`: what has been measured.
// With `full` it is timed as often as the search needs; what a front is told from is times_in_turns().
Trial measure(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
              std::optional<double> limit, const std::vector<Trial>& before);

// Seconds per frame of each of them, `repeats` runs in turns with the others; and anew, because the least of many
// figures is too good.
std::vector<benchmarks::Times> times_in_turns(const Measuring& measuring,
                                              const std::vector<Configuration>& configurations);

}  // namespace cutproof::tuning
