// Limits of a frame's stages: memory traffic, kernels that wait for one another, and the least time of both (json.md,
// The limits of stages).
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
  // Read and written by the stage. Each array counts once for each kernel that uses it; a gathered array counts as if
  // caches kept all of it. Costs of cut tissue alone are left out: an uncut body does not determine them.
  double bytes = 0;
  int64_t phases = 0;  // sequential kernels
};
using StageLimits = std::array<StageLimit, kStages.size()>;

// Groups of the kernels (gpu/kernels/step/groups.cuh): groups, pairs of group and holder, loose particles, and their
// pairs with holders.
struct Groups {
  double groups = 0, pairs = 0, loose = 0, loose_memberships = 0;
};
Groups groups_of(const Setup& setup, const State& state);

// Of one frame that cuts, on a backend with kernels. Requires a body on a grid.
StageLimits stage_limits(const Setup& setup, const State& state);

// Beside the machine's limits; `median` [s]: of the stage, absent if it did not run.
nlohmann::json limit_json(const StageLimit& limit, const MachineLimits& machine, double median);

}  // namespace cutproof::benchmarks
