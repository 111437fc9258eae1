// What one frame of the schedule did.
#pragma once
#include <array>
#include <cstdint>

namespace cutproof::harness {

struct FrameResult {
  int64_t frame = 0;
  std::array<bool, 6> ran = {};        // by stage
  double total_seconds = 0;            // [s]
  std::array<double, 6> seconds = {};  // by stage [s]
  int64_t removed = 0, debris = 0, alive = 0, clusters = 0, triangles = 0;
};

}  // namespace cutproof::harness

namespace cutproof::cli {
using harness::FrameResult;
}
