// Components in one block of a CUDA device, with labels in shared memory: the smallest label goes from neighbour to
// neighbour until a round changes none. Built a second time WITHOUT_BARRIER before the question whether the round did:
// a warp then leaves before the others have answered. One warp alone is right without it.
#include <cuda_runtime.h>
#include <cutproof/plugin.h>

constexpr int kThreads = 256;
constexpr int64_t kMost = 10000;  // particles that have room in 48 KiB

__global__ void spread(int64_t n, const int64_t* offsets, const int32_t* ends, const uint8_t* alive, int32_t* found) {
  __shared__ int32_t label[kMost];
  __shared__ int32_t last_change;  // the last round in which a label changed
  for (int64_t i = threadIdx.x; i < n; i += kThreads) label[i] = static_cast<int32_t>(i);
  if (threadIdx.x == 0) last_change = 0;
  __syncthreads();
  for (int32_t round = 1;; ++round) {
    for (int64_t i = threadIdx.x; i < n; i += kThreads) {
      if (alive[i] == 0) continue;
      for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
        if (alive[ends[k]] == 0) continue;
        const int32_t from = atomicAdd(&label[ends[k]], 0);
        if (atomicMin(&label[i], from) > from) atomicMax(&last_change, round);
      }
    }
#ifndef WITHOUT_BARRIER
    __syncthreads();
#endif
    if (atomicAdd(&last_change, 0) < round) break;
  }
  for (int64_t i = threadIdx.x; i < n; i += kThreads) found[i] = label[i];
}

static int components(const cutproof_host* host, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
                      cutproof_array* label) {
  if (alive->rows > kMost) return 1;
  spread<<<1, kThreads, 0, static_cast<cudaStream_t>(host->stream)>>>(
      alive->rows, static_cast<const int64_t*>(tissue->edge_offsets->data),
      static_cast<const int32_t*>(tissue->edge_ends->data), static_cast<const uint8_t*>(alive->data),
      static_cast<int32_t*>(label->data));
  return cudaGetLastError() == cudaSuccess ? 0 : 1;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
#ifdef WITHOUT_BARRIER
    .name = "labels in a block, a barrier missing",
#else
    .name = "labels in a block",
#endif
    .device = CUTPROOF_CUDA,
    .components = components,
};
CUTPROOF_PLUGIN(plugin)
