// The error of each stage: some frames in lockstep with the reference, and the topology of what they leave.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::benchmarks {

// Frames in lockstep (oracles/comparison/stage_comparison.h). Where no frame of those judged had a stage due, its entry
// is empty.
struct FrameErrors {
  int64_t frames = 0;  // that were judged
  struct Step {
    oracles::ErrorNorm position;  // [h]
    int64_t undecidable = 0;      // particles that are not measured, because rounding decides where they go
  };
  std::optional<Step> step;
  struct Detection {
    int64_t removed = 0, differing = 0;  // particles; differing: removed by one of the two only
    bool within_rounding = true;         // oracle `detection`: every decision outside the rounding band is right
  };
  std::optional<Detection> detect;
  // split, merge, expand: same clusters, same numbers. Empty too where a rule leaves several answers.
  std::array<std::optional<bool>, 6> clusters_equal;
  struct Surface {
    oracles::ErrorNorm vertices;  // [h]
    bool triangles_equal = true;  // as sets; vertices named by owner and direction
  };
  std::optional<Surface> skin;
  std::vector<Verdict> topology;  // of the state after the last judged frame, by the oracles that cost little
  // Coupled groups of clusters beyond the components of the tissue. Where clusters do not cover every edge nothing
  // promises that there is none (method.md §2), so there it is counted, and `component match` is not asked for.
  double isolated_groups = 0;
  bool topology_holds() const;
};
// Runs and judges frames of what `backend` has loaded until one of them has removed something, at most kJudgedFrames.
FrameErrors judge_frames(Backend& backend, const Setup& setup);

}  // namespace cutproof::benchmarks
