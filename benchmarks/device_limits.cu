#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "benchmarks/device_limits.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"

namespace cutproof::gpu {

namespace {

__global__ void empty_kernel() {}

// A stream with two events on it.
class Stopwatch {
 public:
  cudaStream_t stream() const { return stream_.get(); }

  // Seconds that one piece of work takes, `turns` times: each of `repeat` pieces one after the other, so that handing
  // over costs nothing.
  template <class Work>
  std::vector<double> seconds(int turns, int repeat, Work work) {
    for (int k = 0; k < repeat; ++k) work(stream());
    std::vector<double> samples;
    for (int turn = 0; turn < turns; ++turn) {
      CUTPROOF_CUDA(cudaEventRecord(begin_.get(), stream()));
      for (int k = 0; k < repeat; ++k) work(stream());
      CUTPROOF_CUDA(cudaEventRecord(end_.get(), stream()));
      CUTPROOF_CUDA(cudaEventSynchronize(end_.get()));
      float elapsed = 0;
      CUTPROOF_CUDA(cudaEventElapsedTime(&elapsed, begin_.get(), end_.get()));
      samples.push_back(1e-3 * static_cast<double>(elapsed) / repeat);
    }
    return samples;
  }

 private:
  Stream stream_ = make_stream();
  Event begin_ = make_event(), end_ = make_event();
};

class Chain {
 public:
  Chain(cudaStream_t stream, int kernels) {
    CUTPROOF_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed));
    for (int k = 0; k < kernels; ++k) empty_kernel<<<1, 32, 0, stream>>>();
    const cudaError_t launched = cudaGetLastError();
    cudaGraph_t captured = nullptr;
    CUTPROOF_CUDA(cudaStreamEndCapture(stream, &captured));
    const Graph graph(captured);
    check_cuda(launched, "empty_kernel", __FILE__, __LINE__);
    executable_ = make_executable(graph.get());
  }
  void launch(cudaStream_t stream) const { CUTPROOF_CUDA(cudaGraphLaunch(executable_.get(), stream)); }

 private:
  ExecutableGraph executable_;
};

double median(std::vector<double> samples) {
  std::sort(samples.begin(), samples.end());
  return samples[samples.size() / 2];
}

DeviceMemory filled_memory(std::size_t bytes, int value) {
  DeviceMemory memory = make_device_memory(bytes);
  CUTPROOF_CUDA(cudaMemset(memory.get(), value, bytes));
  return memory;
}

}  // namespace

DeviceLimits measure_device_limits(int repeats) {
  constexpr int kShort = 40, kLong = 400;
  DeviceLimits limits;
  Stopwatch stopwatch;
  {
    constexpr std::size_t kBytes = std::size_t{1} << 30, kChecked = std::size_t{16} << 20;
    const DeviceMemory from = filled_memory(kBytes, 1), to = filled_memory(kBytes, 0);
    CUTPROOF_CUDA(cudaDeviceSynchronize());
    limits.copy = stopwatch.seconds(repeats, 4, [&](cudaStream_t stream) {
      CUTPROOF_CUDA(cudaMemcpyAsync(to.get(), from.get(), kBytes, cudaMemcpyDeviceToDevice, stream));
    });
    limits.copy_bytes = 2.0 * static_cast<double>(kBytes);
    limits.copy_bytes_per_second = limits.copy_bytes / median(limits.copy);
    std::vector<unsigned char> end(kChecked);
    CUTPROOF_CUDA(cudaMemcpy(end.data(), static_cast<const unsigned char*>(to.get()) + (kBytes - kChecked), kChecked,
                             cudaMemcpyDeviceToHost));
    limits.bytes_lost = std::count_if(end.begin(), end.end(), [](unsigned char byte) { return byte != 1; });
  }
  const Chain few(stopwatch.stream(), kShort), many(stopwatch.stream(), kLong);
  limits.short_chain = stopwatch.seconds(repeats, 1, [&](cudaStream_t stream) { few.launch(stream); });
  limits.long_chain = stopwatch.seconds(repeats, 1, [&](cudaStream_t stream) { many.launch(stream); });
  limits.chain_seconds = median(limits.short_chain);
  limits.graph_node_seconds = (median(limits.long_chain) - limits.chain_seconds) / (kLong - kShort);
  return limits;
}

int64_t device_bytes_in_use() {
  std::size_t free = 0, all = 0;
  CUTPROOF_CUDA(cudaMemGetInfo(&free, &all));
  return static_cast<int64_t>(all - free);
}

}  // namespace cutproof::gpu
