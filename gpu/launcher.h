// How kernels are started. A Launcher is used by frame.h to write down the work of a frame once; DeviceLauncher
// (device_launcher.cuh) captures it into a CUDA graph, HostLauncher (host_launcher.h) carries it out on the spot.
//
// Members of a Launcher:
//   template <class Kernel, class... Args>
//   void items(Kernel, int64_t capacity, Args...);             grid-stride kernels: as many threads as is sensible for
//                                                              up to `capacity` items
//   template <class Kernel, class... Args>
//   void blocks(Kernel, int64_t capacity, int threads, std::size_t shared_bytes, Args...);
//                                                              block-stride over up to `capacity` jobs, one block each;
//                                                              `threads` is for the device (host: 32)
//   void if_nonzero(const int* flag, Body);                    what `Body` (a callable that launches) does happens only
//                                                              if *flag is not 0 when the work before it is done
//   void while_nonzero(int* flag, Body);                       again and again while *flag is not 0
//   void exclusive_scan(const int* in, int* out, int64_t count, int* total);   out[i] = Σ in[0..i), *total = Σ all
//   void select(const unsigned char* flags, int64_t count, int* selected, int* selected_count);
//                                                              indices with a flag, ascending
//   void sort_unique(unsigned long long* keys, int* count, int64_t capacity);  ascending, duplicates gone, in place;
//                                                              *count <= capacity valid keys before and after
//   void clear(void* data, std::size_t bytes);                 zero bytes
//
// A kernel is handed over as an object, because a function template cannot be: CUTPROOF_KERNEL(verb_noun_kernel)
// defines the type verb_noun_kernel_object, whose operator() calls it.
#pragma once

#include "gpu/block.h"

#define CUTPROOF_KERNEL(name)                                       \
  struct name##_object {                                            \
    template <class Block, class... Args>                           \
    CUTPROOF_DEVICE void operator()(Block& block, Args... args) const { \
      name(block, args...);                                         \
    }                                                               \
  }
