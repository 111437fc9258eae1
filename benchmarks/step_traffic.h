// The memory traffic that a step cannot do without, and what that takes at best (results_schema.md, The limit of
// step).
#pragma once
#include <cstdint>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::benchmarks {

// Bytes that the kernels of one frame's step read and write, with each array counted once for each kernel that uses
// it, and what the caches keep of a gathered array counted as if it were all of it.
struct StepTraffic {
  double bytes = 0;
  int64_t launches = 0;  // kernels one after the other
};
StepTraffic step_traffic(const Setup& setup, const State& state);

}  // namespace cutproof::benchmarks
