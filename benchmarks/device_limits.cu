#include <cooperative_groups.h>
#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "benchmarks/device_limits.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"

namespace cutproof::gpu {

namespace {

__global__ void empty_kernel() {}

// Follows `next` from its first line, `steps` times.
__global__ void walk_kernel(const int* next, int steps, int* end) {
  int at = 0;
  for (int k = 0; k < steps; ++k) at = __ldcg(next + at);
  *end = at;
}

// Blocks meet `meetings` times; *missed counts blocks that continue before another has arrived.
__global__ void meet_kernel(int meetings, int* came, int* missed) {
  const cooperative_groups::grid_group grid = cooperative_groups::this_grid();
  for (int k = 0; k + 1 < meetings; ++k) grid.sync();
  if (threadIdx.x == 0) atomicAdd(came, 1);
  grid.sync();
  if (threadIdx.x == 0 && __ldcg(came) % gridDim.x != 0) atomicAdd(missed, 1);
}

// A stream with two events on it.
class Stopwatch {
 public:
  cudaStream_t stream() const { return stream_.get(); }

  // Seconds of one piece of work, `turns` times: a turn runs `repeat` pieces in sequence, which hides the launch.
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

// A walk through every line of a buffer that fits into the second cache but not the first, in unpredictable order. A
// fixed seed makes it the same on every device.
struct Walk {
  static constexpr int kLineInts = 32, kLines = 1 << 15;  // 128 bytes a line, 4 MiB
  std::vector<int> next = std::vector<int>(std::size_t{kLines} * kLineInts, 0);
  int end = 0;

  explicit Walk(int steps) {
    std::vector<int> order(kLines);
    std::iota(order.begin(), order.end(), 0);
    std::mt19937 random(1);
    for (std::size_t k = kLines - 1; k > 1; --k) {  // the walk begins in the first line
      std::swap(order[k], order[1 + random() % k]);
    }
    for (std::size_t k = 0; k < kLines; ++k) {
      next[static_cast<std::size_t>(order[k]) * kLineInts] = order[(k + 1) % kLines] * kLineInts;
    }
    end = order[static_cast<std::size_t>(steps) % kLines] * kLineInts;
  }
};

void measure_round_trip(Stopwatch& stopwatch, int repeats, DeviceLimits& limits) {
  const Walk walk(DeviceLimits::kWalk);
  const std::size_t bytes = walk.next.size() * sizeof(int);
  const DeviceMemory next = make_device_memory(bytes), end = make_device_memory(sizeof(int));
  CUTPROOF_CUDA(cudaMemcpy(next.get(), walk.next.data(), bytes, cudaMemcpyHostToDevice));
  for (int turn = 0; turn < repeats; ++turn) {
    CUTPROOF_CUDA(cudaMemset(end.get(), 0xff, sizeof(int)));
    CUTPROOF_CUDA(cudaDeviceSynchronize());
    limits.walk.push_back(stopwatch
                              .seconds(1, 1,
                                       [&](cudaStream_t stream) {
                                         walk_kernel<<<1, 1, 0, stream>>>(static_cast<const int*>(next.get()),
                                                                          DeviceLimits::kWalk,
                                                                          static_cast<int*>(end.get()));
                                         check_cuda(cudaGetLastError(), "walk_kernel", __FILE__, __LINE__);
                                       })
                              .front());
    int ended = 0;
    CUTPROOF_CUDA(cudaMemcpy(&ended, end.get(), sizeof(int), cudaMemcpyDeviceToHost));
    if (ended != walk.end) ++limits.walks_lost;
  }
  limits.l2_round_trip_seconds = median(limits.walk) / DeviceLimits::kWalk;
}

void measure_meetings(Stopwatch& stopwatch, int repeats, DeviceLimits& limits) {
  int device = 0, multiprocessors = 0;
  CUTPROOF_CUDA(cudaGetDevice(&device));
  CUTPROOF_CUDA(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  const DeviceMemory counts = make_device_memory(2 * sizeof(int));
  CUTPROOF_CUDA(cudaMemset(counts.get(), 0, 2 * sizeof(int)));
  CUTPROOF_CUDA(cudaDeviceSynchronize());
  const auto seconds = [&](int meetings) {
    return stopwatch.seconds(repeats, 1, [&](cudaStream_t stream) {
      int* came = static_cast<int*>(counts.get());
      int* missed = came + 1;
      void* arguments[] = {&meetings, &came, &missed};
      CUTPROOF_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(&meet_kernel),
                                                static_cast<unsigned>(multiprocessors), 128, arguments, 0, stream));
    });
  };
  limits.few_meetings = seconds(DeviceLimits::kFewMeetings);
  limits.many_meetings = seconds(DeviceLimits::kManyMeetings);
  limits.grid_sync_seconds = (median(limits.many_meetings) - median(limits.few_meetings)) /
                             (DeviceLimits::kManyMeetings - DeviceLimits::kFewMeetings);
  int missed = 0;
  CUTPROOF_CUDA(cudaMemcpy(&missed, static_cast<const int*>(counts.get()) + 1, sizeof(int), cudaMemcpyDeviceToHost));
  limits.meetings_missed = missed;
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
  measure_round_trip(stopwatch, repeats, limits);
  measure_meetings(stopwatch, repeats, limits);
  return limits;
}

int64_t device_bytes_in_use() {
  std::size_t free = 0, all = 0;
  CUTPROOF_CUDA(cudaMemGetInfo(&free, &all));
  return static_cast<int64_t>(all - free);
}

}  // namespace cutproof::gpu
