// What a body does in a scene.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "oracles/comparison/trajectory.h"

namespace cutproof::tuning {

// Frames are the scene's: those into which a fast blade divides them do not show.
struct Trajectory {
  std::vector<oracles::Pose> frames;  // at the end of each
  std::vector<int64_t> stroke_end;    // [strokes] the frame at whose end a stroke is complete; -1: the run ends before
};

// In which way the tissue is in a different number of parts at the end of a stroke, which each of the two may reach in
// a frame of its own, or at the end; empty: it is not.
std::string difference_in_parts(const Trajectory& expected, const Trajectory& actual);

// How two runs of a body differ in what they remove, in the frames that both have. A removal is an event of a frame:
// however near two runs are to each other, what lies between them can fall on either side of it, and then positions
// differ by what the removal does and no longer by what the runs differ in.
struct RemovalsApart {
  int64_t in_another_frame = 0;  // particles that both have lost, each in another frame
  int64_t alive_in_one = 0;      // particles that only one of the two still has after the last frame
};
RemovalsApart removals_apart(const Trajectory& expected, const Trajectory& actual);

}  // namespace cutproof::tuning
