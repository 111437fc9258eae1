// What a frame's stages cannot do without: memory traffic, kernels that wait for one another, and what both take at
// best (json.md, The limits of stages).
#pragma once
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "benchmarks/machine_limits.h"
#include "gpu/state/plan.h"
#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof::benchmarks {

struct StageLimit {
  // That the stage reads and writes, each array counted once for each kernel that uses it, and what the caches keep of
  // a gathered array counted as if it were all of it. What only cut tissue costs is left out: it has no share that a
  // body has before it is cut.
  double bytes = 0;
  int64_t phases = 0;  // kernels one after the other
};
using StageLimits = std::array<StageLimit, kStages.size()>;

// What kernels make of the clusters (gpu/kernels/step/groups.cuh): groups, pairs of a group and a holder, particles
// that are in no group, and how many clusters have these, counted for each.
struct Groups {
  double groups = 0, pairs = 0, loose = 0, loose_memberships = 0;
};
Groups groups_of(const Setup& setup, const State& state);

// Of one frame that cuts, on a backend that runs the kernels. Requires a body on a grid.
StageLimits stage_limits(const Setup& setup, const State& state);

// Beside what the machine does at best; `median` [s]: of the stage, absent if it did not run.
nlohmann::json limit_json(const StageLimit& limit, const MachineLimits& machine, double median);

}  // namespace cutproof::benchmarks
