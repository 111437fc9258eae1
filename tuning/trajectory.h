// The motion of a body in a scene.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "oracles/comparison/trajectory.h"

namespace cutproof::tuning {

// Frames are the scene's; the parts into which a fast blade divides them are hidden.
struct Trajectory {
  std::vector<oracles::Pose> frames;  // at the end of each
  std::vector<int64_t> stroke_end;    // [strokes] the frame that completes each stroke; -1: the run ends before
};

// In words, where the tissue has a different number of parts: at the end of a stroke, which the two runs may reach in
// different frames, or at the end. Empty: nowhere.
std::string difference_in_parts(const Trajectory& expected, const Trajectory& actual);

// Differences between two runs of a body in removals and unions, in their common frames. These are events: however near
// two runs are, a decision between them can separate them. Positions then differ by the event's effect, not by the
// runs' difference.
struct EventsApart {
  int64_t in_another_frame = 0;  // particles that both have lost, in different frames
  int64_t alive_in_one = 0;      // particles that only one has after the last frame
  // Greatest number of clusters that only one run has, in frames after which both have the same particles. Removals in
  // other substeps of a frame are merged in another order.
  int64_t clusters_in_one = 0;

  bool remove_the_same() const { return in_another_frame == 0 && alive_in_one == 0; }
};
EventsApart events_apart(const Trajectory& expected, const Trajectory& actual);

}  // namespace cutproof::tuning
