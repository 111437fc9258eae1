// Messages about kernels that break a rule of block.h.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>

#include "gpu/host/live_block.h"

namespace cutproof::gpu {

// A kernel broke a rule of block.h. Names the kernel, the block and the threads.
class KernelFault : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

// "three_stages_kernel, block 2 of 64"
std::string place_of(const Job& job, const LiveBlock& block);
// "threads 0-3,7"
std::string list(std::uint32_t threads);
// "sync (split.cuh:123)"
std::string describe(const Meeting& meeting);
// Which threads wait where in a deadlock.
std::string describe_stop(const Job& job, const LiveBlock& block);

}  // namespace cutproof::gpu
