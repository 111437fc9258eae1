// CUDA resources, freed by destructors, also where a constructor fails. Freeing is not checked: it meets only errors
// already reported, and a destructor could not report one.
#pragma once
#include <cuda_runtime_api.h>

#include <cstddef>
#include <memory>
#include <type_traits>

#include "gpu/device/cuda_check.h"

namespace cutproof::gpu {

template <auto release>
struct Release {
  template <class T>
  void operator()(T* held) const {
    static_cast<void>(release(held));
  }
};
template <class Handle, auto release>
using Held = std::unique_ptr<std::remove_pointer_t<Handle>, Release<release>>;

using Stream = Held<cudaStream_t, cudaStreamDestroy>;
using Event = Held<cudaEvent_t, cudaEventDestroy>;
using Graph = Held<cudaGraph_t, cudaGraphDestroy>;
using ExecutableGraph = Held<cudaGraphExec_t, cudaGraphExecDestroy>;
using DeviceMemory = Held<void*, cudaFree>;
using PinnedMemory = Held<void*, cudaFreeHost>;

// All throw MachineError.
inline Stream make_stream() {
  cudaStream_t stream = nullptr;
  CUTPROOF_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  return Stream(stream);
}
inline Event make_event() {
  cudaEvent_t event = nullptr;
  CUTPROOF_CUDA(cudaEventCreate(&event));
  return Event(event);
}
inline DeviceMemory make_device_memory(std::size_t bytes) {
  void* memory = nullptr;
  CUTPROOF_CUDA(cudaMalloc(&memory, bytes));
  return DeviceMemory(memory);
}
inline bool has_memory_on_demand() {
  int device = 0, can = 0;
  CUTPROOF_CUDA(cudaGetDevice(&device));
  CUTPROOF_CUDA(cudaDeviceGetAttribute(&can, cudaDevAttrConcurrentManagedAccess, device));
  return can != 0;
}
// Pages are allocated where the device first touches them; those of the first `at_once` bytes now. Requires
// has_memory_on_demand().
inline DeviceMemory make_device_memory_on_demand(std::size_t bytes, std::size_t at_once) {
  void* memory = nullptr;
  CUTPROOF_CUDA(cudaMallocManaged(&memory, bytes));
  DeviceMemory held(memory);
  int device = 0;
  CUTPROOF_CUDA(cudaGetDevice(&device));
#if CUDART_VERSION >= 13000
  const cudaMemLocation place = {cudaMemLocationTypeDevice, device};
  CUTPROOF_CUDA(cudaMemAdvise(memory, bytes, cudaMemAdviseSetPreferredLocation, place));
  if (at_once > 0) CUTPROOF_CUDA(cudaMemPrefetchAsync(memory, at_once, place, 0, nullptr));
#else
  CUTPROOF_CUDA(cudaMemAdvise(memory, bytes, cudaMemAdviseSetPreferredLocation, device));
  if (at_once > 0) CUTPROOF_CUDA(cudaMemPrefetchAsync(memory, at_once, device, nullptr));
#endif
  return held;
}
// Completes cudaMemcpy and cudaMemset. A copy from unpinned memory may return before it ends, and our streams do not
// wait for the default one: a kernel would read old data.
inline void wait_for_copies() { CUTPROOF_CUDA(cudaStreamSynchronize(nullptr)); }
inline PinnedMemory make_pinned_memory(std::size_t bytes) {
  void* memory = nullptr;
  CUTPROOF_CUDA(cudaMallocHost(&memory, bytes));
  return PinnedMemory(memory);
}
inline ExecutableGraph make_executable(cudaGraph_t graph) {
  cudaGraphExec_t executable = nullptr;
  CUTPROOF_CUDA(cudaGraphInstantiate(&executable, graph, 0));
  return ExecutableGraph(executable);
}

}  // namespace cutproof::gpu
