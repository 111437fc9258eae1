// The Block of kernels on the host (block.h): 32 threads, each a fibre. Every rule of block.h that a kernel breaks is a
// KernelFault. Examples are a barrier or collective that not all threads reach, and a warp operation whose mask names a
// lane that does not come. Others are shared memory beyond the launch's grant, or taken in different order.
//
// Or one thread alone, for speed. It meets no other thread, so it can break none of these rules, and a collective
// returns the thread's own value. Warp operations need 32 threads: with one thread they are a KernelFault.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "gpu/host/worker.h"
#include "gpu/launch/block.h"

namespace cutproof::gpu {

class HostBlock {
 public:
  static constexpr bool on_device = false;

  HostBlock(Worker& worker, LiveBlock& state, int thread)
      : worker_(worker), state_(state), thread_(thread), size_(worker.job().threads), count_(worker.job().blocks) {}

  int thread() const { return thread_; }
  int size() const { return size_; }
  int index() const { return state_.index; }
  int count() const { return count_; }
  std::int64_t first() const { return static_cast<std::int64_t>(state_.index) * size_ + thread_; }
  std::int64_t stride() const { return static_cast<std::int64_t>(count_) * size_; }
  int lane() const { return thread_; }

  void sync(Where where = Where::here()) {
    if (alone()) return;
    meet(Operation::sync, kEveryone, where, [] {});
  }

  template <class T>
  T* shared(int count) {
    static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= 16);
    return static_cast<T*>(worker_.shared(state_, thread_, static_cast<std::size_t>(count) * sizeof(T)));
  }

  template <class T>
  T sum(T value, Where where = Where::here()) {
    if (alone()) return value;
    return reduce(Operation::sum, value, where, [](T a, T b) { return a + b; });
  }
  template <class T>
  T smallest(T value, Where where = Where::here()) {
    if (alone()) return value;
    return reduce(Operation::smallest, value, where, [](T a, T b) { return b < a ? b : a; });
  }
  bool any(bool value, Where where = Where::here()) {
    if (alone()) return value;
    return reduce(Operation::any, static_cast<int>(value), where, [](int a, int b) { return a | b; }) != 0;
  }
  int exclusive_scan(int value, int& total, Where where = Where::here()) {
    if (alone()) {
      total = value;
      return 0;
    }
    bring(value);
    meet(Operation::exclusive_scan, kEveryone, where, [&] {
      int before = 0;
      for (int i = 0; i < kHostThreads; ++i) {
        put(i, before);
        before += brought<int>(i);
      }
      for (int i = 0; i < kHostThreads; ++i) std::memcpy(state_.result[i] + sizeof(int), &before, sizeof(int));
    });
    std::memcpy(&total, state_.result[thread_] + sizeof(int), sizeof(int));
    return taken<int>();
  }

  unsigned ballot(unsigned mask, bool value, Where where = Where::here()) {
    if (alone()) refuse_alone("a ballot");
    bring(static_cast<unsigned>(value));
    meet(Operation::ballot, mask, where, [&] {
      unsigned votes = 0;
      for_lanes(mask, [&](int i) { votes |= brought<unsigned>(i) << i; });
      for_lanes(mask, [&](int i) { put(i, votes); });
    });
    return taken<unsigned>();
  }
  template <class T>
  T shuffle(unsigned mask, T value, int lane, Where where = Where::here()) {
    if (alone()) refuse_alone("a shuffle");
    if (lane < 0 || lane >= kHostThreads || (mask >> lane & 1u) == 0) {
      worker_.fault(state_, thread_, "shuffles from lane " + std::to_string(lane) + ", which is not in its mask");
    }
    bring(value);
    source_lane() = lane;
    meet(Operation::shuffle, mask, where, [&] { for_lanes(mask, [&](int i) { put(i, brought<T>(source_lane(i))); }); });
    return taken<T>();
  }
  void sync_warp(unsigned mask, Where where = Where::here()) { ballot(mask, false, where); }

  // T: int, unsigned or unsigned long long.
  template <class T>
  T atomic_add(T* at, std::type_identity_t<T> value) {
    return update(at, [value](T old) { return static_cast<T>(old + value); });
  }
  template <class T>
  T atomic_min(T* at, std::type_identity_t<T> value) {
    return update(at, [value](T old) { return std::min(old, value); });
  }
  template <class T>
  T atomic_max(T* at, std::type_identity_t<T> value) {
    return update(at, [value](T old) { return std::max(old, value); });
  }
  template <class T>
  T atomic_or(T* at, std::type_identity_t<T> value) {
    return update(at, [value](T old) { return static_cast<T>(old | value); });
  }
  template <class T>
  T atomic_exchange(T* at, std::type_identity_t<T> value) {
    return update(at, [value](T) { return value; });
  }
  template <class T>
  T atomic_cas(T* at, std::type_identity_t<T> expected, std::type_identity_t<T> desired) {
    worker_.before_access(state_, thread_);
    if (worker_.alone()) {
      const T old = *at;
      if (old == expected) *at = desired;
      return old;
    }
    std::atomic_ref<T>(*at).compare_exchange_strong(expected, desired, std::memory_order_relaxed);
    return expected;
  }
  template <class T>
  T load(const T* at) {
    worker_.before_access(state_, thread_);
    // atomic_ref takes no const until C++26.
    return std::atomic_ref<T>(*const_cast<T*>(at)).load(std::memory_order_relaxed);
  }
  template <class T>
  void store(T* at, std::type_identity_t<T> value) {
    worker_.before_access(state_, thread_);
    std::atomic_ref<T>(*at).store(value, std::memory_order_relaxed);
  }
  void fence() {
#if defined(__SANITIZE_THREAD__)
    // ThreadSanitizer knows no fences; a read-modify-write of one place orders the same.
    static std::atomic<int> everyone{0};
    everyone.fetch_add(1, std::memory_order_seq_cst);
#else
    std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
  }
  void wait_for_earlier() {}  // launches follow one another

 private:
  static constexpr unsigned kEveryone = LiveBlock::kAll;

  bool alone() const { return size_ == 1; }
  [[noreturn]] void refuse_alone(const char* what) {
    worker_.fault(state_, thread_, std::string("runs alone and asks for ") + what + ", which is of 32 threads");
  }

  // The last to arrive runs `complete` for all.
  template <class Complete>
  void meet(Operation operation, unsigned mask, const Where& where, Complete complete) {
    if (worker_.arrive(state_, thread_, {operation, mask, where})) {
      complete();
      worker_.release(state_, thread_);
    } else {
      worker_.wait(state_);
    }
  }

  template <class T, class Combine>
  T reduce(Operation operation, T value, const Where& where, Combine combine) {
    static_assert(std::is_integral_v<T>);
    bring(value);
    meet(operation, kEveryone, where, [&] {
      T all = brought<T>(0);
      for (int i = 1; i < kHostThreads; ++i) all = combine(all, brought<T>(i));
      for (int i = 0; i < kHostThreads; ++i) put(i, all);
    });
    return taken<T>();
  }

  template <class T>
  void bring(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kMostValueBytes);
    std::memcpy(state_.value[thread_], &value, sizeof(T));
  }
  template <class T>
  T brought(int thread) const {
    T value;
    std::memcpy(&value, state_.value[thread], sizeof(T));
    return value;
  }
  template <class T>
  void put(int thread, const T& value) {
    std::memcpy(state_.result[thread], &value, sizeof(T));
  }
  template <class T>
  T taken() const {
    T value;
    std::memcpy(&value, state_.result[thread_], sizeof(T));
    return value;
  }
  int& source_lane() { return state_.source_lane[thread_]; }
  int source_lane(int thread) const { return state_.source_lane[thread]; }

  template <class Do>
  static void for_lanes(unsigned mask, Do what) {
    for (int i = 0; i < kHostThreads; ++i) {
      if ((mask >> i & 1u) != 0) what(i);
    }
  }

  template <class T, class Change>
  T update(T* at, Change change) {
    worker_.before_access(state_, thread_);
    if (worker_.alone()) {
      const T old = *at;
      *at = change(old);
      return old;
    }
    std::atomic_ref<T> place(*at);
    T old = place.load(std::memory_order_relaxed);
    while (!place.compare_exchange_weak(old, change(old), std::memory_order_relaxed)) {
    }
    return old;
  }

  Worker& worker_;
  LiveBlock& state_;
  int thread_, size_;
  int count_;
};

}  // namespace cutproof::gpu
