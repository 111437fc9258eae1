#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "gpu/cuda_check.h"
#include "gpu/floors.h"

namespace cutproof::gpu {

namespace {

__global__ void empty_kernel() {}

// A stream with two events on it.
class Stopwatch {
 public:
  Stopwatch() {
    CUTPROOF_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
    CUTPROOF_CUDA(cudaEventCreate(&begin_));
    CUTPROOF_CUDA(cudaEventCreate(&end_));
  }
  ~Stopwatch() {
    static_cast<void>(cudaEventDestroy(begin_));
    static_cast<void>(cudaEventDestroy(end_));
    static_cast<void>(cudaStreamDestroy(stream_));
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  cudaStream_t stream() const { return stream_; }

  // Seconds that one piece of work takes: median over `turns` of `repeat` pieces one after the other, so that handing
  // over costs nothing.
  template <class Work>
  double seconds(int turns, int repeat, Work work) {
    for (int k = 0; k < repeat; ++k) work(stream_);
    std::vector<float> milliseconds;
    for (int turn = 0; turn < turns; ++turn) {
      CUTPROOF_CUDA(cudaEventRecord(begin_, stream_));
      for (int k = 0; k < repeat; ++k) work(stream_);
      CUTPROOF_CUDA(cudaEventRecord(end_, stream_));
      CUTPROOF_CUDA(cudaEventSynchronize(end_));
      float elapsed = 0;
      CUTPROOF_CUDA(cudaEventElapsedTime(&elapsed, begin_, end_));
      milliseconds.push_back(elapsed);
    }
    std::sort(milliseconds.begin(), milliseconds.end());
    return 1e-3 * static_cast<double>(milliseconds[milliseconds.size() / 2]) / repeat;
  }

 private:
  cudaStream_t stream_ = nullptr;
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
};

class Chain {
 public:
  Chain(cudaStream_t stream, int kernels) {
    CUTPROOF_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed));
    for (int k = 0; k < kernels; ++k) empty_kernel<<<1, 32, 0, stream>>>();
    cudaGraph_t graph = nullptr;
    CUTPROOF_CUDA(cudaStreamEndCapture(stream, &graph));
    const cudaError_t status = cudaGraphInstantiate(&executable_, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    CUTPROOF_CUDA(status);
  }
  ~Chain() { static_cast<void>(cudaGraphExecDestroy(executable_)); }
  Chain(const Chain&) = delete;
  Chain& operator=(const Chain&) = delete;
  void launch(cudaStream_t stream) const { CUTPROOF_CUDA(cudaGraphLaunch(executable_, stream)); }

 private:
  cudaGraphExec_t executable_ = nullptr;
};

class DeviceBytes {
 public:
  explicit DeviceBytes(std::size_t bytes) {
    CUTPROOF_CUDA(cudaMalloc(&data_, bytes));
    CUTPROOF_CUDA(cudaMemset(data_, 1, bytes));
  }
  ~DeviceBytes() { static_cast<void>(cudaFree(data_)); }
  DeviceBytes(const DeviceBytes&) = delete;
  DeviceBytes& operator=(const DeviceBytes&) = delete;
  void* data() const { return data_; }

 private:
  void* data_ = nullptr;
};

}  // namespace

Floors measure_floors() {
  constexpr int kShort = 40, kLong = 400, kTurns = 21;
  Floors floors;
  Stopwatch stopwatch;
  {
    constexpr std::size_t kBytes = std::size_t{1} << 30;
    const DeviceBytes from(kBytes), to(kBytes);
    CUTPROOF_CUDA(cudaDeviceSynchronize());
    const double seconds = stopwatch.seconds(kTurns, 4, [&](cudaStream_t stream) {
      CUTPROOF_CUDA(cudaMemcpyAsync(to.data(), from.data(), kBytes, cudaMemcpyDeviceToDevice, stream));
    });
    floors.copy_bytes_per_second = 2.0 * static_cast<double>(kBytes) / seconds;
  }
  const Chain few(stopwatch.stream(), kShort), many(stopwatch.stream(), kLong);
  floors.chain_seconds = stopwatch.seconds(kTurns, 1, [&](cudaStream_t stream) { few.launch(stream); });
  const double longer = stopwatch.seconds(kTurns, 1, [&](cudaStream_t stream) { many.launch(stream); });
  floors.graph_node_seconds = (longer - floors.chain_seconds) / (kLong - kShort);
  return floors;
}

}  // namespace cutproof::gpu
