// Verifies the written scene: read back from its text and run by a fresh backend.
#pragma once
#include <cstdint>
#include <string>

#include "tuning/measurement.h"

namespace cutproof::tuning {

// A run of it with every oracle and every expectation of the scene.
struct JudgedRun {
  Configuration configuration;
  std::string text;  // the scene's
  Setup setup;
  Trajectory trajectory;
  int64_t verdicts = 0;  // checked
  std::string failure;   // of a verdict; empty: all hold
};
// `path`: where the scene will be written.
JudgedRun judged_run(const Measuring& measuring, const Configuration& configuration, const std::string& path);

struct Verified {
  Trial trial;           // without times
  int64_t verdicts = 0;  // checked
  std::string failure;   // empty: it holds
};
// The judged run, and its distance from a reference solution that the search has not seen.
Verified verify(const Measuring& measuring, const ReferenceSolution& reference, JudgedRun run);

}  // namespace cutproof::tuning
