// The error of each stage: some frames in lockstep with the reference, and the topology after them.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::benchmarks {

// Frames in lockstep (oracles/comparison/stage_comparison.h). Entries of stages that were due in no judged frame are
// empty.
struct FrameErrors {
  int64_t frames = 0;  // judged
  struct Step {
    oracles::ErrorNorm position;  // [h]
    int64_t undecidable = 0;      // particles not measured, because rounding decides their place
  };
  std::optional<Step> step;
  struct Detection {
    int64_t removed = 0, differing = 0;  // particles; differing: removed by one of the two only
    bool within_rounding = true;         // oracle `detection`: every decision outside the rounding band is right
  };
  std::optional<Detection> detect;
  // split, merge, expand: same clusters, same numbers. Also empty where a rule allows several answers.
  std::array<std::optional<bool>, 6> clusters_equal;
  struct Surface {
    oracles::ErrorNorm vertices;  // [h]
    bool triangles_equal = true;  // as sets; vertices named by owner and direction
  };
  std::optional<Surface> skin;
  std::vector<Verdict> topology;  // of the state after the last judged frame, by cheap oracles
  // Coupled groups of clusters beyond the components of the tissue. Clusters that do not cover every edge allow them
  // (method.md §2). There they are counted, and `component match` is not checked.
  double isolated_groups = 0;
  bool topology_holds() const;
};
// Runs and judges frames of the backend's load until one has removed something, at most kJudgedFrames.
FrameErrors judge_frames(Backend& backend, const Setup& setup);

}  // namespace cutproof::benchmarks
