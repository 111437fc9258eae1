// Lets chosen allocations of a process fail, and counts them. In a process that links failing_allocations.cpp or that
// it is preloaded into, malloc, calloc, realloc, aligned_alloc, posix_memalign, memalign, strdup, operator new
// (libstdc++ makes it from malloc) and mmap go through it, those of the libraries too.
#pragma once
#include <atomic>
#include <cstdint>
#include <limits>

namespace cutproof::tests {

// Two ways to fail; either may be used alone. Counting begins with 1.
// - By number: allocations fail_at … fail_at + fail_count - 1 fail. Those that HDF5 and its compressors make for
//   themselves have no number and never fail so: HDF5 1.10 does not survive it (model/io/hdf5_file.cpp).
// - By amount: what would take the process beyond `limit` bytes fails, whoever asks for it.
struct AllocationControl {
  static constexpr uint64_t kAllFromThere = std::numeric_limits<uint64_t>::max();

  std::atomic<uint64_t> fail_at{0};  // 0: none fails by its number
  std::atomic<uint64_t> fail_count{1};
  std::atomic<int64_t> limit{0};  // [bytes] 0: none
  // What is found out.
  std::atomic<uint64_t> made{0};    // allocations that have a number, those that failed included
  std::atomic<uint64_t> failed{0};  // how many were made to fail
  std::atomic<int64_t> wanted{0};   // [bytes] that would have been in use had the first beyond the limit not failed
  std::atomic<int64_t> most{0};     // [bytes] in use at once
};

// The file that holds the AllocationControl of a program that the library is preloaded into. There the control begins
// with main.
inline constexpr const char* kControlVariable = "CUTPROOF_ALLOCATION_CONTROL";

// For a program that links it: from now on `control` counts and decides; null: nobody does.
void control_allocations(AllocationControl* control);

// Blocks that were allocated and not freed since the process began.
int64_t live_blocks();

}  // namespace cutproof::tests
