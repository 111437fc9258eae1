// The Launcher of launcher.h that works on the host, synchronously. Kernels are executed by operating-system threads,
// or simulated under a schedule (thread_schedule.h). If kernels keep the rules of block.h, results depend neither on
// the number of those threads nor on the threads of a block.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "gpu/host/host_block.h"
#include "gpu/host/host_runtime.h"
#include "gpu/host/turns.h"
#include "gpu/launch/launcher.h"

namespace cutproof::gpu {

class HostLauncher {
 public:
  struct Threads {
    int count = 1;                // operating-system threads, the caller's included
    int of_block = kHostThreads;  // 1: quick, but cannot check the rules of block.h
  };
  using Simulated = SimulationOptions;

  static constexpr int kMostBlocks = 64;                  // of a launch; simulated: SimulationOptions::live_blocks
  static constexpr std::int64_t kMostRounds = 1'000'000;  // of a while_nonzero, beyond which it counts as a livelock

  explicit HostLauncher(Threads mode)
      : runtime_(std::make_unique<HostRuntime>(mode.count)), blocks_(kMostBlocks), threads_(mode.of_block) {
    if (threads_ != 1 && threads_ != kHostThreads) {
      throw std::invalid_argument("HostLauncher: a block has 1 or " + std::to_string(kHostThreads) + " threads, not " +
                                  std::to_string(threads_));
    }
    unshared_ = threads_ == 1 && mode.count == 1;
  }
  explicit HostLauncher(Simulated mode) {
    blocks_ = mode.live_blocks;
    runtime_ = std::make_unique<HostRuntime>(std::move(mode));
  }
  HostLauncher() : HostLauncher(Threads{}) {}

  template <class Kernel, class... Args>
  void items(Kernel kernel, std::int64_t capacity, Args... args) {
    // Every thread has at most about 8 items, so that its neighbours' next reads are still in the cache. An odd number
    // of blocks keeps its items out of the same cache lines. A thread alone takes them in sequence.
    if (unshared_) return launch(kernel, 1, 1, 0, args...);
    const std::int64_t all = (capacity + kHostThreads - 1) / kHostThreads;
    const std::int64_t most = runtime_->simulated() ? blocks_ : std::max<std::int64_t>(kMostBlocks, all / 8 | 1);
    launch(kernel, std::min(all, most), kHostThreads, 0, args...);
  }
  // A team on the host is one thread.
  template <class Kernel, class... Args>
  void teams(Kernel kernel, int, std::int64_t capacity, Args... args) {
    items(kernel, capacity, args...);
  }
  template <class Kernel, class... Args>
  void blocks(Kernel kernel, std::int64_t capacity, int threads, std::size_t shared_bytes, Args... args) {
    check_threads<Kernel>(threads);
    launch(kernel, std::min<std::int64_t>(capacity, unshared_ ? 1 : blocks_), threads_, shared_bytes, args...);
  }

  template <class Body>
  void if_nonzero(const int* flag, Body body) {
    next_turn();
    if (*flag != 0) body(*this);
  }
  template <class Body>
  void while_nonzero(int* flag, Body body) {
    next_turn();
    for (std::int64_t round = 0; *flag != 0; ++round) {
      if (round == kMostRounds) {
        throw KernelFault("livelock: a loop did not end within " + std::to_string(kMostRounds) + " rounds.");
      }
      body(*this);
    }
  }

  bool overlaps() const { return simulated(); }
  template <class First, class Second, class AfterFirst = NoWork, class AfterBoth = NoWork>
  void side_by_side(First first, Second second, AfterFirst after_first = {}, AfterBoth after_both = {}) {
    if (!simulated() || turns_ != nullptr) {
      first(*this);
      second(*this);
      after_first(*this);
      after_both(*this);
      return;
    }
    Turns turns([&](int current) { return runtime_->choose(2, current); });
    turns_ = &turns;
    try {
      turns.run(
          [&] {
            first(*this);
            turns.arrive();
            after_first(*this);
          },
          [&] {
            second(*this);
            turns.await();
            after_both(*this);
          });
    } catch (...) {
      turns_ = nullptr;
      throw;
    }
    turns_ = nullptr;
  }

  void exclusive_scan(const int* in, int* out, std::int64_t count, int* total, const int* used = nullptr) {
    next_turn();
    count = used_of(count, used, "exclusive_scan");
    const int sum = std::accumulate(in, in + count, 0);
    std::exclusive_scan(in, in + count, out, 0);
    *total = sum;
  }
  void select(const unsigned char* flags, std::int64_t count, int* selected, int* selected_count,
              const int* used = nullptr) {
    next_turn();
    count = used_of(count, used, "select");
    int* end = selected;
    for (std::int64_t i = 0; i < count; ++i) {
      if (flags[i] != 0) *end++ = static_cast<int>(i);
    }
    *selected_count = static_cast<int>(end - selected);
  }
  void sort_unique(unsigned long long* keys, int* count, std::int64_t capacity) {
    next_turn();
    if (*count < 0 || *count > capacity) {
      throw KernelFault("sort_unique: " + std::to_string(*count) + " keys with a capacity of " +
                        std::to_string(capacity) + '.');
    }
    std::sort(keys, keys + *count);
    if (*count > 0 && keys[*count - 1] == ~0ull) throw KernelFault("sort_unique: ~0 is not a key.");
    unsigned long long* const end = std::unique(keys, keys + *count);
    std::fill(end, keys + *count, ~0ull);  // so that no kernel relies on the rest
    *count = static_cast<int>(end - keys);
  }
  void clear(void* data, std::size_t bytes) {
    next_turn();
    if (bytes > 0) std::memset(data, 0, bytes);
  }

  // All choices so far, if SimulationOptions::record was set.
  const ThreadSchedule& recorded() const { return runtime_->recorded(); }
  // Continues under another schedule, with an empty record. Cheaper than another launcher, because stacks are kept.
  // Requires a simulated launcher.
  void reschedule(Generator schedule) { runtime_->reschedule(std::move(schedule)); }
  bool simulated() const { return runtime_->simulated(); }

 private:
  // Lets the other of two parallel pieces of work continue if the schedule says so.
  void next_turn() {
    if (turns_ != nullptr) turns_->next();
  }
  static std::int64_t used_of(std::int64_t count, const int* used, const char* what) {
    if (used == nullptr) return count;
    if (*used < 0 || *used > count) {
      throw KernelFault(std::string(what) + ": " + std::to_string(*used) + " items of " + std::to_string(count) +
                        " are to be used.");
    }
    return *used;
  }
  template <class Kernel, class... Args>
  void launch(const Kernel& kernel, std::int64_t blocks, int threads, std::size_t shared_bytes, const Args&... args) {
    next_turn();
    const auto call = [&](HostBlock& block) { kernel(block, args...); };
    Job job;
    job.kernel = kernel_name<Kernel>();
    job.run = [](const void* closure, HostBlock& block) { (*static_cast<decltype(&call)>(closure))(block); };
    job.call = &call;
    job.blocks = static_cast<int>(std::max<std::int64_t>(blocks, 1));
    job.threads = threads;
    job.shared_bytes = shared_bytes;
    runtime_->run(job);
  }

  std::unique_ptr<HostRuntime> runtime_;
  Turns* turns_ = nullptr;  // null: nothing runs side by side
  int blocks_ = kMostBlocks;
  int threads_ = kHostThreads;  // of a block
  bool unshared_ = false;       // one thread does everything
};

}  // namespace cutproof::gpu
