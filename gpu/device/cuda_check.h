// Every CUDA call is checked: a failure is a MachineError with the call's text, file and line.
#pragma once
#include <cuda_runtime_api.h>

#include <string>

#include "model/error.h"

namespace cutproof::gpu {

inline void check_cuda(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) return;
  // Otherwise the next launch would report errors that are not sticky.
  static_cast<void>(cudaGetLastError());
  throw MachineError(std::string("CUDA failed: ") + cudaGetErrorString(status) + " (" + cudaGetErrorName(status) +
                     ") in " + call + " at " + file + ':' + std::to_string(line));
}

}  // namespace cutproof::gpu

#define CUTPROOF_CUDA(call) ::cutproof::gpu::check_cuda((call), #call, __FILE__, __LINE__)
