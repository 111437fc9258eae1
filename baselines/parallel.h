// Kernels as functions of an index, for a CUDA device and, by the same source, for the host.
//
// An executor (Host, or Device where nvcc compiles) has memory and these operations; a simulator is a template over it.
//   for_each(n, f)        calls f(i) for i in 0 .. n - 1, in any order or at once: f must not depend on what another
//                         call writes. f is a lambda [=] BASELINES_KERNEL(int64_t i), over pointers.
//   for_each(times, count, f)  likewise for times * *count calls; `count` lies in the executor's memory
//   sort(keys, values)    ascending; equal keys keep their order
//   scan(counts, starts)  starts[i] = counts[0] + .. + counts[i - 1]; starts has one entry more
//   sums(values, starts, out)  out[s] = values[starts[s]] + .. + values[starts[s + 1] - 1], in an order that depends on
//                         that segment alone
//   repeat(recording, f)  calls f, which only launches, over memory that stays where it is. A device records it the
//   second
//                         time, and then launches it as a whole; recording.forget() when memory or parameters change.
// Sums, and so all results of a simulator without atomics, have the same bits in every run.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#ifdef __CUDACC__
#include <cuda_runtime.h>

#include <new>
#define BASELINES_HOST_DEVICE __host__ __device__
#else
#define BASELINES_HOST_DEVICE
#endif
#define BASELINES_KERNEL BASELINES_HOST_DEVICE

namespace cutproof::baselines {

class Host {
 public:
  template <class T>
  class Array {
   public:
    explicit Array(std::size_t size = 0) : values_(size) {}
    explicit Array(const std::vector<T>& values) : values_(values) {}
    T* data() { return values_.data(); }
    const T* data() const { return values_.data(); }
    std::size_t size() const { return values_.size(); }
    std::vector<T> copy() const { return values_; }  // to the host

   private:
    std::vector<T> values_;
  };

  template <class F>
  void for_each(std::size_t n, F f) {
    for (std::size_t i = 0; i < n; ++i) f(static_cast<int64_t>(i));
  }
  template <class F>
  void for_each(std::size_t times, const int32_t* count, F f) {
    for_each(times * static_cast<std::size_t>(*count), f);
  }
  void sort(Array<uint32_t>& keys, Array<int32_t>& values) {
    std::vector<int32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) { return keys.data()[a] < keys.data()[b]; });
    const std::vector<uint32_t> old_keys = keys.copy();
    const std::vector<int32_t> old_values = values.copy();
    for (std::size_t i = 0; i < order.size(); ++i) {
      keys.data()[i] = old_keys[static_cast<std::size_t>(order[i])];
      values.data()[i] = old_values[static_cast<std::size_t>(order[i])];
    }
  }
  void scan(const Array<int32_t>& counts, Array<int32_t>& starts) {
    starts.data()[0] = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) starts.data()[i + 1] = starts.data()[i] + counts.data()[i];
  }
  void sums(const Array<float>& values, const Array<int32_t>& starts, Array<float>& out) {
    for (std::size_t s = 0; s + 1 < starts.size(); ++s) {
      out.data()[s] = std::accumulate(values.data() + starts.data()[s], values.data() + starts.data()[s + 1], 0.0f);
    }
  }
  struct Recording {
    void forget() {}
  };
  template <class F>
  void repeat(Recording&, F f) {
    f();
  }
  void finish() {}
};

#ifdef __CUDACC__

inline void check(cudaError_t error) {
  if (error == cudaErrorMemoryAllocation) {
    cudaGetLastError();  // it is no error of the next call
    throw std::bad_alloc();
  }
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

template <class F>
__global__ void each(int64_t n, F f) {
  const int64_t i = int64_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < n) f(i);
}
template <class F>
__global__ void each(int64_t times, const int32_t* count, F f) {
  const int64_t n = times * *count, stride = int64_t{gridDim.x} * blockDim.x;
  for (int64_t i = int64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < n; i += stride) f(i);
}

class Device {
 public:
  template <class T>
  class Array {
   public:
    // Without initial values it begins as zeros, as on the host.
    explicit Array(std::size_t size = 0) : size_(size) {
      if (size_ == 0) return;
      check(cudaMalloc(&data_, size_ * sizeof(T)));
      check(cudaMemset(data_, 0, size_ * sizeof(T)));
    }
    explicit Array(const std::vector<T>& values) : Array(values.size()) {
      if (size_ > 0) check(cudaMemcpy(data_, values.data(), size_ * sizeof(T), cudaMemcpyHostToDevice));
    }
    Array(Array&& other) noexcept : data_(other.data_), size_(other.size_) { other.data_ = nullptr, other.size_ = 0; }
    Array& operator=(Array&& other) noexcept {
      std::swap(data_, other.data_);
      std::swap(size_, other.size_);
      return *this;
    }
    ~Array() { cudaFree(data_); }
    T* data() { return data_; }
    const T* data() const { return data_; }
    std::size_t size() const { return size_; }
    std::vector<T> copy() const {
      std::vector<T> values(size_);
      if (size_ > 0) check(cudaMemcpy(values.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
      return values;
    }

   private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
  };

  // Throws std::runtime_error where there is no device.
  Device() { check(cudaStreamCreate(&stream_)); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() { cudaStreamDestroy(stream_); }

  template <class F>
  void for_each(std::size_t n, F f) {
    if (n == 0) return;
    each<<<static_cast<unsigned>((n + kThreads - 1) / kThreads), kThreads, 0, stream_>>>(static_cast<int64_t>(n), f);
    check(cudaGetLastError());
  }
  template <class F>
  void for_each(std::size_t times, const int32_t* count, F f) {
    constexpr unsigned kBlocks = 2048;  // fill a device; threads go on in strides
    each<<<kBlocks, kThreads, 0, stream_>>>(static_cast<int64_t>(times), count, f);
    check(cudaGetLastError());
  }
  void sort(Array<uint32_t>& keys, Array<int32_t>& values);
  void scan(const Array<int32_t>& counts, Array<int32_t>& starts);
  void sums(const Array<float>& values, const Array<int32_t>& starts, Array<float>& out);
  class Recording {
   public:
    Recording() = default;
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;
    ~Recording() { forget(); }
    void forget() {
      if (graph_ != nullptr) cudaGraphExecDestroy(graph_);
      graph_ = nullptr, is_warm_ = false;
    }

   private:
    friend class Device;
    cudaGraphExec_t graph_ = nullptr;
    bool is_warm_ = false;  // memory for temporary results is there
  };
  template <class F>
  void repeat(Recording& recording, F f) {
    if (!recording.is_warm_) {
      recording.is_warm_ = true;
      return f();
    }
    if (recording.graph_ == nullptr) {
      cudaGraph_t graph;
      check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal));
      f();
      check(cudaStreamEndCapture(stream_, &graph));
      const cudaError_t error = cudaGraphInstantiate(&recording.graph_, graph, 0);
      cudaGraphDestroy(graph);
      check(error);
    }
    check(cudaGraphLaunch(recording.graph_, stream_));
  }
  void finish() { check(cudaStreamSynchronize(stream_)); }

 private:
  static constexpr unsigned kThreads = 64;
  template <class F>
  void with_room(F call);
  cudaStream_t stream_ = nullptr;
  Array<unsigned char> room_{1};
  Array<uint32_t> spare_keys_;  // [keys of the last sort]
  Array<int32_t> spare_values_;
};

#endif

}  // namespace cutproof::baselines
