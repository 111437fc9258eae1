// Components on a CUDA device: the smallest label goes from neighbour to neighbour until none changes any more. A
// kernel of its own for each round, so that each sees all of the one before.
#include <cuda_runtime.h>
#include <cutproof/plugin.h>

__global__ void begin(int64_t n, int32_t* label) {
  const int64_t i = blockIdx.x * int64_t{blockDim.x} + threadIdx.x;
  if (i < n) label[i] = static_cast<int32_t>(i);
}

__global__ void spread(int64_t n, const int64_t* offsets, const int32_t* ends, const uint8_t* alive, int32_t* label,
                       int32_t* changed) {
  const int64_t i = blockIdx.x * int64_t{blockDim.x} + threadIdx.x;
  if (i >= n || alive[i] == 0) return;
  for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
    const int32_t j = ends[k];
    if (alive[j] == 0) continue;
    const int32_t from = atomicAdd(&label[j], 0);  // a read that no other thread's write can tear
    if (atomicMin(&label[i], from) > from) *changed = 1;
  }
}

static int components(const cutproof_host* host, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
                      cutproof_array* label) {
  const auto stream = static_cast<cudaStream_t>(host->stream);
  const int64_t n = alive->rows;
  if (n == 0) return 0;
  const auto blocks = static_cast<unsigned>((n + 255) / 256);
  int32_t* changed = nullptr;
  if (cudaMallocAsync(reinterpret_cast<void**>(&changed), sizeof *changed, stream) != cudaSuccess) return 1;
  begin<<<blocks, 256, 0, stream>>>(n, static_cast<int32_t*>(label->data));
  for (int32_t again = 1; again != 0;) {
    cudaMemsetAsync(changed, 0, sizeof *changed, stream);
    spread<<<blocks, 256, 0, stream>>>(n, static_cast<const int64_t*>(tissue->edge_offsets->data),
                                       static_cast<const int32_t*>(tissue->edge_ends->data),
                                       static_cast<const uint8_t*>(alive->data), static_cast<int32_t*>(label->data),
                                       changed);
    cudaMemcpyAsync(&again, changed, sizeof again, cudaMemcpyDeviceToHost, stream);
    if (cudaStreamSynchronize(stream) != cudaSuccess) return 1;
  }
  return cudaFreeAsync(changed, stream) == cudaSuccess ? 0 : 1;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "labels that spread",
    .device = CUTPROOF_CUDA,
    .components = components,
};
CUTPROOF_PLUGIN(plugin)
