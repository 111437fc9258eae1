// The number of a frame's kernels that wait for one another: parts of a span's graph, counted from the code that the
// graph is captured from (gpu/frame.h).
#pragma once
#include <array>
#include <cstdint>

#include "gpu/state/plan.h"
#include "model/stage.h"

namespace cutproof::benchmarks {

// Sequential kernels of each stage's own span, in a frame that cuts. Conditions have their values in an ordinary
// cutting frame. Something is removed, clusters follow, some merge or grow. Nothing fails, no body's whole tissue is
// labelled, no cluster is too large for a block. A loop runs once, and a library call of several kernels counts as one.
std::array<int64_t, kStages.size()> phases_of_stages(const gpu::Plan& plan);

}  // namespace cutproof::benchmarks
