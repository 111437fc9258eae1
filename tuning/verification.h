// Whether the scene that is written holds: read back from its text and run by a fresh backend.
#pragma once
#include <cstdint>
#include <string>

#include "tuning/measurement.h"

namespace cutproof::tuning {

struct Verified {
  Trial trial;           // without times
  int64_t verdicts = 0;  // that were asked for
  std::string failure;   // empty: it holds
};
// Every oracle, every expectation of the scene, and the distance from a reference solution that the search has not
// seen. `text` is the scene's, `path` where it will be written.
Verified verify(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
                const std::string& text, const std::string& path);

}  // namespace cutproof::tuning
