// The Block of kernels on the device (block.h). Everything is inlined as in a plain CUDA kernel, and unused parts cost
// nothing. Block sizes are multiples of 32 (launcher.h checks). Collectives take a number of threads known at run time
// and combine in a fixed order, so equal block sizes give equal bits.
#pragma once
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "gpu/launch/block.h"

namespace cutproof::gpu {

class DeviceBlock {
 public:
  static constexpr bool on_device = true;

  __device__ int thread() const { return static_cast<int>(threadIdx.x); }
  __device__ int size() const { return static_cast<int>(blockDim.x); }
  __device__ int index() const { return static_cast<int>(blockIdx.x); }
  __device__ int count() const { return static_cast<int>(gridDim.x); }
  __device__ std::int64_t first() const { return static_cast<std::int64_t>(index()) * size() + thread(); }
  __device__ std::int64_t stride() const { return static_cast<std::int64_t>(count()) * size(); }
  __device__ int lane() const { return static_cast<int>(threadIdx.x & 31u); }

  __device__ void sync() const { __syncthreads(); }
  __device__ bool any(bool value) const { return __syncthreads_or(value) != 0; }

  template <class T>
  __device__ T* shared(int count) {
    static_assert(alignof(T) <= 16);
    extern __shared__ uint4 cutproof_dynamic_shared[];
    T* const taken = reinterpret_cast<T*>(reinterpret_cast<unsigned char*>(cutproof_dynamic_shared) + shared_used_);
    shared_used_ += (static_cast<unsigned>(count) * static_cast<unsigned>(sizeof(T)) + 15u) & ~15u;
    return taken;
  }

  template <class T>
  __device__ T sum(T value) {
    return reduce(value, [](T a, T b) { return a + b; });
  }
  template <class T>
  __device__ T smallest(T value) {
    return reduce(value, [](T a, T b) { return b < a ? b : a; });
  }
  __device__ int exclusive_scan(int value, int& total) {
    int through = inclusive_scan_in_warp(value);
    if (size() == 32) {
      total = __shfl_sync(kWarp, through, 31);
      return through - value;
    }
    __shared__ int partial[32];
    const int warp = thread() / 32;
    sync();  // the last use of `partial` is over
    if (lane() == 31) partial[warp] = through;
    sync();
    const int warps = size() / 32;
    const int through_warps = inclusive_scan_in_warp(lane() < warps ? partial[lane()] : 0);
    total = __shfl_sync(kWarp, through_warps, 31);
    const int before = __shfl_sync(kWarp, through_warps, warp == 0 ? 0 : warp - 1);
    return through - value + (warp == 0 ? 0 : before);
  }

  __device__ unsigned ballot(unsigned mask, bool value) { return __ballot_sync(mask, value); }
  __device__ unsigned match(unsigned mask, int value) { return __match_any_sync(mask, value); }
  template <class T>
  __device__ T shuffle(unsigned mask, T value, int lane) {
    return by_words(value, [=](unsigned word) { return __shfl_sync(mask, word, lane); });
  }
  __device__ void sync_warp(unsigned mask) { __syncwarp(mask); }

  // T: int, unsigned or unsigned long long.
  template <class T>
  __device__ T atomic_add(T* at, std::type_identity_t<T> value) {
    return atomicAdd(at, value);
  }
  template <class T>
  __device__ T atomic_min(T* at, std::type_identity_t<T> value) {
    return atomicMin(at, value);
  }
  template <class T>
  __device__ T atomic_max(T* at, std::type_identity_t<T> value) {
    return atomicMax(at, value);
  }
  template <class T>
  __device__ T atomic_or(T* at, std::type_identity_t<T> value) {
    return atomicOr(at, value);
  }
  template <class T>
  __device__ T atomic_exchange(T* at, std::type_identity_t<T> value) {
    return atomicExch(at, value);
  }
  template <class T>
  __device__ T atomic_cas(T* at, std::type_identity_t<T> expected, std::type_identity_t<T> desired) {
    return atomicCAS(at, expected, desired);
  }
  template <class T>
  __device__ T load(const T* at) {
    static_assert(sizeof(T) == 4 || sizeof(T) == 8);
    T value;
    if constexpr (sizeof(T) == 4) {
      unsigned bits;
      asm volatile("ld.relaxed.gpu.u32 %0, [%1];" : "=r"(bits) : "l"(at));
      memcpy(&value, &bits, 4);
    } else {
      unsigned long long bits;
      asm volatile("ld.relaxed.gpu.u64 %0, [%1];" : "=l"(bits) : "l"(at));
      memcpy(&value, &bits, 8);
    }
    return value;
  }
  template <class T>
  __device__ void store(T* at, std::type_identity_t<T> value) {
    static_assert(sizeof(T) == 4 || sizeof(T) == 8);
    if constexpr (sizeof(T) == 4) {
      unsigned bits;
      memcpy(&bits, &value, 4);
      asm volatile("st.relaxed.gpu.u32 [%0], %1;" ::"l"(at), "r"(bits));
    } else {
      unsigned long long bits;
      memcpy(&bits, &value, 8);
      asm volatile("st.relaxed.gpu.u64 [%0], %1;" ::"l"(at), "l"(bits));
    }
  }
  __device__ void fence() { __threadfence(); }
  __device__ void wait_for_earlier() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    // In this order, so that the next launch finds the work of all earlier launches done.
    asm volatile("griddepcontrol.wait;" ::: "memory");
    asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
  }

 private:
  static constexpr unsigned kWarp = 0xffffffffu;

  // Applies `exchange` to every 32-bit word of a value.
  template <class T, class Exchange>
  __device__ static T by_words(T value, Exchange exchange) {
    static_assert(std::is_trivially_copyable_v<T>);
    constexpr int kWords = static_cast<int>((sizeof(T) + 3) / 4);
    unsigned words[kWords] = {};
    memcpy(words, &value, sizeof(T));
#pragma unroll
    for (int i = 0; i < kWords; ++i) words[i] = exchange(words[i]);
    memcpy(&value, words, sizeof(T));
    return value;
  }

  template <class T, class Combine>
  __device__ T reduce(T value, Combine combine) const {
    static_assert(std::is_integral_v<T>);  // so every lane finds the same in any order
#pragma unroll
    for (int distance = 16; distance > 0; distance /= 2) {
      value = combine(value, by_words(value, [=](unsigned word) { return __shfl_xor_sync(kWarp, word, distance); }));
    }
    const int warps = size() / 32;
    if (warps == 1) return value;
    __shared__ T partial[32];
    const int lane = static_cast<int>(threadIdx.x & 31u);
    sync();  // the last use of `partial` is over
    if (lane == 0) partial[thread() / 32] = value;
    sync();
    // Every warp adds up all partial results; the tree leaves out those beyond the last warp.
    value = partial[lane < warps ? lane : 0];
#pragma unroll
    for (int distance = 16; distance > 0; distance /= 2) {
      const T other = by_words(value, [=](unsigned word) { return __shfl_down_sync(kWarp, word, distance); });
      if (lane + distance < warps) value = combine(value, other);
    }
    return by_words(value, [](unsigned word) { return __shfl_sync(kWarp, word, 0); });
  }

  __device__ int inclusive_scan_in_warp(int value) const {
#pragma unroll
    for (int distance = 1; distance < 32; distance *= 2) {
      const int other = __shfl_up_sync(kWarp, value, distance);
      if (lane() >= distance) value += other;
    }
    return value;
  }

  unsigned shared_used_ = 0;
};

}  // namespace cutproof::gpu
