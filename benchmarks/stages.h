// The error of each stage: some frames in lockstep with the reference, and the topology of what they leave.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"

namespace cutproof::benchmarks {

// What counts as "beyond" in Distances [h].
inline constexpr double kDistanceBound = 1e-4;

// Distances of a backend's points from the reference's, from the same state.
struct Distances {
  double max = 0, rms = 0;  // [h]
  int64_t beyond = 0;       // points farther than 1e-4 h
};
// One frame in lockstep: each stage of the backend against the reference's from the backend's state before it. Where
// no frame of those judged had a stage due, its entry is empty.
struct FrameErrors {
  int64_t frames = 0;  // that were judged
  std::optional<Distances> step;
  struct Detection {
    int64_t removed = 0, differing = 0;  // particles; differing: removed by one of the two only
    bool within_rounding = true;         // oracle `detection`: every decision outside the rounding band is right
  };
  std::optional<Detection> detect;
  std::array<std::optional<bool>, 6> clusters_equal;  // split, merge, expand: same clusters, same numbers
  struct Surface {
    Distances vertices;
    bool triangles_equal = true;  // as sets; vertices named by owner and direction
  };
  std::optional<Surface> skin;
  std::vector<Verdict> topology;  // of the state after the last judged frame, by the oracles that cost little
  // Coupled groups of clusters beyond the components of the tissue. Where clusters do not cover every edge nothing
  // promises that there is none (method.md §2), so there it is told, and `component match` is not asked for.
  double isolated_groups = 0;
  bool topology_holds() const;
};
// Runs and judges frames of what `backend` has loaded until one of them has removed something, at most kJudgedFrames.
FrameErrors judge_frames(Backend& backend, const Setup& setup);

}  // namespace cutproof::benchmarks
