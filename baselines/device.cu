#include <cuda_runtime.h>

#include <stdexcept>

#include "baselines/dissection.h"

namespace cutproof::baselines {

void require_device() {
  const cudaError_t error = cudaFree(nullptr);
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

}  // namespace cutproof::baselines
