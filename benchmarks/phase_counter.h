// How many kernels of a frame wait for one another: what the graph of a span is made of, counted from the text that the
// graph is captured from (gpu/frame.h).
#pragma once
#include <array>
#include <cstdint>

#include "gpu/state/plan.h"
#include "model/stage.h"

namespace cutproof::benchmarks {

// Kernels one after the other in the span of each stage alone, in a frame that cuts: conditions hold that hold in an
// ordinary cutting frame (something is removed, clusters follow, some merge or grow; nothing fails, no body's whole
// tissue is labelled, no cluster is larger than a block labels), a loop turns once, and what a library does by several
// kernels counts as one.
std::array<int64_t, kStages.size()> phases_of_stages(const gpu::Plan& plan);

}  // namespace cutproof::benchmarks
