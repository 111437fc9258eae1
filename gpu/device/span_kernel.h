// A whole span as one kernel, of one block or of as many as run side by side (span_kernel.cu).
#pragma once
#include <cuda_runtime.h>

#include "gpu/launch/plan.h"
#include "gpu/state/device_view.h"
#include "model/stage.h"

namespace cutproof::gpu {

inline constexpr int kMostSpanBlocks = 1024;
inline constexpr int kMostInSpanCluster = 2048;  // particles of a cluster: more do not fit into its shared memory

// Whether the kernel can run this load.
bool fits_span_kernel(const DeviceView& w, const Plan& plan);
// To be called once for the device in use. Returns how many blocks run side by side. Throws MachineError.
int prepare_span_kernel();
// Does not wait for the device. partials: device memory, kMostSpanBlocks ints. Requires fits_span_kernel() and as
// many blocks as prepare_span_kernel() has said, at most. Throws MachineError.
void launch_span(const DeviceView& w, const Plan& plan, Span span, int* partials, int blocks, cudaStream_t stream);

}  // namespace cutproof::gpu
