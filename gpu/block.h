// What a kernel sees of the machine (docs/architecture.md, Kernels). Every kernel is one function template
//
//   template <class Block> CUTPROOF_DEVICE void verb_noun_kernel(Block& block, World world, ...);
//
// that is instantiated with DeviceBlock (device_block.cuh: inlined intrinsics and CUB) by nvcc and with HostBlock
// (host_block.h: each thread a stackful fibre) by any C++20 compiler. Rules that make both the same program:
//
// - Loops are block-stride (or grid-stride) and assume no block size. Host blocks have 32 threads.
// - sync() and the collectives sum, smallest, any and exclusive_scan are reached by all threads of the block.
// - Warp operations name their participants in `mask`; each of those reaches the same operation with the same mask.
// - Shared memory is taken with shared<T>(count), in the same order by all threads, and holds garbage at first.
// - Memory that other threads write in the same launch is touched through load, store and the atomics only.
// - No float atomics: sums must not depend on the schedule.
//
// Members of a Block, B standing for DeviceBlock or HostBlock:
//   static constexpr bool on_device;
//   int thread(), size(), index(), count();     thread in block, threads per block, block in grid, blocks in grid
//   int64_t first(), stride();                  for grid-stride loops over single items: index·size + thread, count·size
//   void sync();
//   T* shared<T>(int count);                    aligned to 16 bytes
//   T sum<T>(T), T smallest<T>(T), bool any(bool);   to all threads; in a fixed order, so floats are reproducible
//   int exclusive_scan(int value, int& total);  in thread order
//   unsigned ballot(unsigned mask, bool); T shuffle<T>(unsigned mask, T, int lane); int lane();
//   int atomic_add(int*, int), atomic_min(int*, int), atomic_max(int*, int), atomic_exchange(int*, int),
//       atomic_cas(int*, int expected, int desired), atomic_or(int*, int);   all return the old value, relaxed
//   int load(const int*); void store(int*, int);     relaxed
//   void fence();                                    orders this thread's memory operations for the whole grid
#pragma once

#if defined(__CUDACC__)
#define CUTPROOF_DEVICE __device__
#define CUTPROOF_BOTH __host__ __device__
#else
#define CUTPROOF_DEVICE
#define CUTPROOF_BOTH
#endif
