// gpu/launch: the contracts between kernels and backends: a Block (block.h), a Team (team.h) and, in this file, a
// Launcher, which starts kernels. frame.h gives it the work of a frame. DeviceLauncher (device_launcher.cuh) captures
// that into a CUDA graph or starts its kernels one by one; HostLauncher (host_launcher.h) executes it at once.
//
// Members of a Launcher:
//   template <class Kernel, class... Args>
//   void items(Kernel, int64_t capacity, Args...);             grid-stride kernels: a sensible number of threads for
//                                                              up to `capacity` items; no shared memory
//   template <class Kernel, class... Args>
//   void teams(Kernel, int lanes, int64_t capacity, Args...);  items, for up to `capacity` jobs of a Team each (team.h)
//   template <class Kernel, class... Args>
//   void blocks(Kernel, int64_t capacity, int threads, std::size_t shared_bytes, Args...);
//                                                              block-stride over up to `capacity` jobs, one block each;
//                                                              `threads` is for the device (host: 32 or 1), a multiple
//                                                              of 32 up to kMaxThreads of the kernel
//   void if_nonzero(const int* flag, Body);                    executes the launches of `Body`, a callable, only if
//                                                              *flag is not 0 after all earlier work
//   void while_nonzero(int* flag, Body);                       repeats them while *flag is not 0
//   template <class First, class Second, class AfterFirst = NoWork, class AfterBoth = NoWork>
//   void side_by_side(First, Second, AfterFirst = {}, AfterBoth = {});
//                                                              runs First and Second in parallel, then AfterFirst and
//                                                              AfterBoth, each as soon as its name says. None touches
//                                                              data of another that it does not wait for
//   bool overlaps() const;                                     whether being side by side makes a difference
//   void exclusive_scan(const int* in, int* out, int64_t count, int* total, const int* used = nullptr);
//                                                              out[i] = Σ in[0..i), *total = Σ all; in == out is
//                                                              allowed
//   void select(const unsigned char* flags, int64_t count, int* selected, int* selected_count,
//               const int* used = nullptr);                    indices with a flag, ascending
//                                                              only the first *used <= count items are valid; *used
//                                                              is known after all earlier work
//   void sort_unique(unsigned long long* keys, int* count, int64_t capacity);  ascending, duplicates gone, in place;
//                                                              *count <= capacity valid keys before and after; the rest
//                                                              is overwritten; ~0 is not a key
//   void clear(void* data, std::size_t bytes);                 zero bytes, of whole ints
// `Body`, `First` and the others take the Launcher to use inside as their argument. Even with a capacity of 0 one block
// runs, because a kernel may have work to do once.
//
// A kernel is passed as an object, because a function template cannot be: CUTPROOF_KERNEL(verb_noun_kernel)
// defines the type verb_noun_kernel_object, whose operator() calls it. CUTPROOF_KERNEL_THREADS(verb_noun_kernel, n)
// allows blocks of up to n threads on the device instead of 256 (the compiler then has 65536 / n registers a thread).
//
// A launch may begin while the last blocks of the previous one work, and then waits for them: this hides its start. A
// kernel whose object has kReadsAhead = true calls wait_for_earlier() itself. Before that it may read data that the
// previous launch does not write. (Older data is complete: a launch begins only when the previous one no longer waits.)
#pragma once
#include <stdexcept>
#include <string>

#include "gpu/launch/block.h"

#define CUTPROOF_KERNEL_THREADS(name, most_threads)                            \
  struct name##_object {                                                       \
    static constexpr const char* kName = #name;                                \
    [[maybe_unused]] static constexpr int kMaxThreads = most_threads;          \
    template <class Block, class... Args>                                      \
    CUTPROOF_DEVICE void operator()(Block& block, const Args&... args) const { \
      name(block, args...);                                                    \
    }                                                                          \
  }
#define CUTPROOF_KERNEL(name) CUTPROOF_KERNEL_THREADS(name, 256)

namespace cutproof::gpu {

// A piece of work that launches nothing.
struct NoWork {
  template <class Launcher>
  void operator()(Launcher&) const {}
};

template <class Kernel>
constexpr const char* kernel_name() {
  if constexpr (requires { Kernel::kName; }) {
    return Kernel::kName;
  } else {
    return "kernel";
  }
}

template <class Kernel>
constexpr int max_threads() {
  if constexpr (requires { Kernel::kMaxThreads; }) {
    return Kernel::kMaxThreads;
  } else {
    return 256;
  }
}

// How many of its largest blocks a multiprocessor should hold; the compiler limits a thread's registers accordingly. 0:
// no limit.
template <class Kernel>
constexpr int min_blocks() {
  if constexpr (requires { Kernel::kMinBlocks; }) {
    return Kernel::kMinBlocks;
  } else {
    return 0;
  }
}

template <class Kernel>
constexpr bool reads_ahead() {
  if constexpr (requires { Kernel::kReadsAhead; }) {
    return Kernel::kReadsAhead;
  } else {
    return false;
  }
}

// Throws std::logic_error if a block may not have so many threads.
template <class Kernel>
void check_threads(int threads) {
  if (threads < 32 || threads > max_threads<Kernel>() || threads % 32 != 0) {
    throw std::logic_error(std::string(kernel_name<Kernel>()) + ": a block of " + std::to_string(threads) +
                           " threads was asked for; allowed are multiples of 32 up to " +
                           std::to_string(max_threads<Kernel>()) + '.');
  }
}

}  // namespace cutproof::gpu
