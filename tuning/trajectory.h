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

// How two runs of a body differ in what they remove and unite, in the frames that both have. These are events: however
// near two runs are to each other, what lies between them can fall on either side of one, and then positions differ by
// what the event does and no longer by what the runs differ in.
struct EventsApart {
  int64_t in_another_frame = 0;  // particles that both have lost, each in another frame
  int64_t alive_in_one = 0;      // particles that only one of the two still has after the last frame
  // Of frames after which both have the same particles, the greatest number of clusters that only one of the two has:
  // what goes in other substeps of a frame is merged in another order.
  int64_t clusters_in_one = 0;

  bool remove_the_same() const { return in_another_frame == 0 && alive_in_one == 0; }
};
EventsApart events_apart(const Trajectory& expected, const Trajectory& actual);

}  // namespace cutproof::tuning
