// A launch, and a block of it while the host executes it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace cutproof::gpu {

inline constexpr int kHostThreads = 32;             // threads of a host block: one warp, or one alone (Job::threads)
inline constexpr std::size_t kMostValueBytes = 16;  // of a value in collectives and shuffles

class HostBlock;
struct Runner;

enum class Operation : unsigned char { sync, sum, smallest, any, exclusive_scan, ballot, shuffle };

// A place in a kernel. (std::source_location is not known to the Clang of Debian 12.)
struct Where {
  const char* file = "";
  int line = 0;
  static constexpr Where here(const char* file = __builtin_FILE(), int line = __builtin_LINE()) { return {file, line}; }
};

// Where a thread waits: threads meet if all three fields agree.
struct Meeting {
  Operation operation = Operation::sync;
  std::uint32_t mask = 0;
  Where where;
};

// One launch.
struct Job {
  const char* kernel = "";
  void (*run)(const void* call, HostBlock& block) = nullptr;
  const void* call = nullptr;  // the kernel and its arguments
  int blocks = 0;
  int threads = kHostThreads;    // of a block: kHostThreads, or 1, which needs no fibres
  std::size_t shared_bytes = 0;  // most that a block may take
};

// A block in execution. Sets of threads are masks of 32 bits.
struct LiveBlock {
  static constexpr std::uint32_t kAll = ~0u;

  int place = 0;  // among the blocks alive at once
  int index = 0;
  std::uint32_t started = 0, waiting = 0, done = kAll;
  bool cancelled = false;  // after a failure: threads unwind when resumed
  Meeting meeting[kHostThreads];
  int first_waiting = 0;              // the first of the waiting threads to arrive
  bool agreeing = true;               // all waiting threads are at the same place as that one
  Runner* runner[kHostThreads] = {};  // the runner of each started thread

  // Shared memory, poisoned with 0xff bytes when first requested.
  struct Request {
    std::size_t offset, bytes;
  };
  std::unique_ptr<std::byte[]> shared;
  std::size_t shared_capacity = 0, shared_used = 0;
  std::vector<Request> requests;             // of the most advanced thread
  std::size_t requested[kHostThreads] = {};  // how many, by thread

  alignas(16) std::byte value[kHostThreads][kMostValueBytes];   // each thread's input to a meeting
  alignas(16) std::byte result[kHostThreads][kMostValueBytes];  // its result
  int source_lane[kHostThreads] = {};                           // of shuffles
};

inline std::uint32_t bit(int thread) { return 1u << thread; }
// Threads meet where this holds.
inline bool same(const Meeting& a, const Meeting& b) {
  return a.operation == b.operation && a.mask == b.mask && a.where.line == b.where.line &&
         (a.where.file == b.where.file || std::strcmp(a.where.file, b.where.file) == 0);
}

}  // namespace cutproof::gpu
