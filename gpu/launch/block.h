// The machine, as kernels see it (docs/design/kernels.md, Blocks). Every kernel is one function template
//
//   template <class Block> CUTPROOF_DEVICE void verb_noun_kernel(Block& block, DeviceView view, ...);
//
// that is instantiated with DeviceBlock (device_block.cuh: inlined intrinsics and CUB) by nvcc and with HostBlock
// (host_block.h: each thread a stackful fibre) by any C++20 compiler. Rules that make both the same program:
//
// - Loops are block-stride (or grid-stride) and assume no block size. Host blocks have 32 threads, or 1.
// - sync() and the collectives sum, smallest, any and exclusive_scan are reached by all threads of the block.
// - Warp operations name their participants in `mask`; each of those reaches the same operation with the same mask.
// - Shared memory is taken with shared<T>(count), in the same order by all threads, and is undefined at first.
// - Memory that other threads write in the same launch is touched through load, store and the atomics only.
// - No float atomics: sums must not depend on the schedule.
//
// HostBlock throws a KernelFault for each violation that it sees. In the simulated mode the schedule may let another
// thread go first at every atomic, load and store, but not at plain accesses.
//
// Members of a Block, B standing for DeviceBlock or HostBlock:
//   static constexpr bool on_device;
//   int thread(), size(), index(), count();     thread in block, threads per block, block in grid, blocks in grid;
//                                               sizes are multiples of 32
//   int64_t first(), stride();                  for grid-stride loops over single items:
//                                               index·size + thread, count·size
//   void sync();
//   T* shared<T>(int count);                    aligned to 16 bytes; counts against the launch's shared_bytes,
//                                               rounded up to a multiple of 16
//   T sum<T>(T), T smallest<T>(T), bool any(bool);   to all threads. T: an integer; sums of floats would depend on the
//                                               block size, so teams have them (team.h)
//   int exclusive_scan(int value, int& total);  in thread order
//   unsigned match(unsigned mask, int);         (DeviceBlock) the lanes of `mask` with the same value, as a mask
//   unsigned ballot(unsigned mask, bool); T shuffle<T>(unsigned mask, T, int lane); int lane();
//   void sync_warp(unsigned mask);              as sync(), for these lanes of the warp
//   T atomic_add(T*, T), atomic_min(T*, T), atomic_max(T*, T), atomic_exchange(T*, T),
//     atomic_cas(T*, T expected, T desired), atomic_or(T*, T);   all return the old value, relaxed; T: int, unsigned or
//                                               unsigned long long
//   T load(const T*); void store(T*, T);        relaxed; T of 4 or 8 bytes
//   void fence();                               orders this thread's memory operations for the whole grid
//   void wait_for_earlier();                    returns when all work before this launch is done. Every kernel begins
//                                               with it, unless it reads ahead (launcher.h); may be repeated
#pragma once

#if defined(__CUDACC__)
#define CUTPROOF_DEVICE __device__
#define CUTPROOF_BOTH __host__ __device__
#else
#define CUTPROOF_DEVICE
#define CUTPROOF_BOTH
#endif
// Keeps a loop from being unrolled: code that few threads rarely execute must be fetched anew each time, which takes
// longer than its work.
#if defined(__CUDA_ARCH__)
#define CUTPROOF_ROLLED _Pragma("unroll 1")
#else
#define CUTPROOF_ROLLED
#endif
