// How the host executes kernels: the threads of a block are stackful fibres (Boost.Context), blocks are spread over
// operating-system threads or, simulated, interleaved on one under a schedule. Nothing here is seen by kernels; they
// see HostBlock (host_block.h). Launches are made by HostLauncher (host_launcher.h).
//
// Order of execution, threads: a thread of a block runs until it waits at a barrier or collective, or ends; then the
// lowest that can run does. A thread that never waits costs no fibre switch. Simulated: every atomic, load and store is
// a point at which another thread of any live block may go on instead; memory is sequentially consistent, and plain
// accesses are not such points.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "gpu/host/thread_schedule.h"

namespace cutproof::gpu {

inline constexpr int kHostThreads = 32;             // threads of a host block: one warp
inline constexpr std::size_t kMostValueBytes = 64;  // of a value that collectives and shuffles carry

// A kernel broke a rule of block.h. Names the kernel, the block and the threads.
class KernelFault : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

class HostBlock;
class Worker;
struct Fibre;

enum class Operation : unsigned char { sync, sum, warp_sum, smallest, any, exclusive_scan, ballot, shuffle };

// A place in a kernel. (std::source_location is not known to the Clang of Debian 12.)
struct Where {
  const char* file = "";
  int line = 0;
  static constexpr Where here(const char* file = __builtin_FILE(), int line = __builtin_LINE()) { return {file, line}; }
};

// Where a thread waits: threads meet if all three agree.
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
  std::size_t shared_bytes = 0;  // what a block may take
};

// A block that is being executed. Sets of threads are masks of 32 bits.
struct LiveBlock {
  static constexpr std::uint32_t kAll = ~0u;

  int place = 0;  // among the blocks alive at once
  int index = 0;
  std::uint32_t started = 0, waiting = 0, done = kAll;
  bool cancelled = false;  // something failed: threads unwind when they are resumed
  Meeting meeting[kHostThreads];
  int first_waiting = 0;  // the first of those that are waiting to have come
  bool agreeing = true;   // all that are waiting wait at the same place as that one
  Fibre* fibre[kHostThreads] = {};

  // Shared memory: poisoned with 0xff bytes where it is first asked for.
  struct Request {
    std::size_t offset, bytes;
  };
  std::unique_ptr<std::byte[]> shared;
  std::size_t shared_capacity = 0, shared_used = 0;
  std::vector<Request> requests;             // of the thread that is furthest
  std::size_t requested[kHostThreads] = {};  // how many, by thread

  alignas(16) std::byte value[kHostThreads][kMostValueBytes];   // what each thread brings to a meeting
  alignas(16) std::byte result[kHostThreads][kMostValueBytes];  // what it takes away
  int source_lane[kHostThreads] = {};                           // of shuffles
};

struct SimulationOptions {
  Generator schedule;                     // drives all launches of the launcher, one after the other
  int live_blocks = 8;                    // blocks interleaved at once; the next begins when one of them ends
  std::int64_t step_budget = 50'000'000;  // decisions in one launch, beyond which it counts as a livelock
  bool record = false;                    // whether HostRuntime::recorded() keeps the choices
};

// Executes blocks on one operating-system thread at a time.
class Worker {
 public:
  Worker();
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Carries out blocks of `job`, taking them from `next`, until there are none left or `failed` is set. Sets `failed`
  // and keeps the exception if a thread throws or a rule is broken; never throws.
  void run(const Job& job, std::atomic<int>& next, std::atomic<bool>& failed, bool alone);
  // As run, but simulated; all blocks from 0 on.
  void simulate(const Job& job, SimulationOptions& options, Schedule& recorded);

  // What failed in the last run, and in which block; null: nothing.
  std::exception_ptr error;
  int error_block = -1;

  // For HostBlock.
  bool simulated() const { return simulation_ != nullptr; }
  bool alone() const { return alone_; }  // no other operating-system thread touches memory now: atomics may be plain
  const Job& job() const { return *job_; }
  void before_access(LiveBlock& block, int thread) {
    if (simulation_ != nullptr) yield(block, thread);
  }
  // Whether `thread` is the last to arrive: then it fills in the results and calls release; otherwise it calls wait.
  bool arrive(LiveBlock& block, int thread, const Meeting& meeting);
  void release(LiveBlock& block, int thread);
  void wait(LiveBlock& block);
  void* shared(LiveBlock& block, int thread, std::size_t bytes);
  [[noreturn]] void fault(const LiveBlock& block, int thread, const std::string& what) const;

 private:
  friend struct Fibre;
  struct Next {
    LiveBlock* block;  // null: nothing is left to do
    int thread;
  };
  void yield(LiveBlock& block, int thread);
  void go(int live_blocks);
  void prepare(int live_blocks);
  bool start_block(LiveBlock& block);
  Next pick();
  void enter(Next next);
  void switch_to(Fibre* to);
  void loop(Fibre* self);
  void check_progress(LiveBlock& block);
  void fail(const LiveBlock& block, std::exception_ptr what);
  Fibre* free_fibre();

  std::vector<std::unique_ptr<LiveBlock>> blocks_;
  std::vector<std::uint32_t> runnable_;  // by place: threads that are not started or can go on
  std::vector<std::unique_ptr<Fibre>> fibres_;
  std::vector<Fibre*> free_;
  std::unique_ptr<Fibre> main_;
  Fibre* current_ = nullptr;
  Fibre* previous_ = nullptr;

  const Job* job_ = nullptr;
  std::atomic<int>* next_ = nullptr;
  std::atomic<bool>* failed_ = nullptr;
  bool alone_ = true;

  SimulationOptions* simulation_ = nullptr;
  Schedule* recorded_ = nullptr;
  std::int64_t steps_ = 0;
  int last_thread_ = 0;
};

// All workers of a launcher.
class HostRuntime {
 public:
  // Requires threads >= 1. Throws MachineError if the system refuses a thread.
  explicit HostRuntime(int threads);
  explicit HostRuntime(SimulationOptions simulation);
  ~HostRuntime();

  bool simulated() const { return simulation_ != nullptr; }
  // Carries out the launch. Rethrows what a kernel threw; of several failures that of the lowest block.
  void run(const Job& job);
  const Schedule& recorded() const { return recorded_; }
  // Goes on under another schedule, with nothing recorded. Requires simulated().
  void reschedule(Generator schedule);

 private:
  struct Pool;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Pool> pool_;
  std::unique_ptr<SimulationOptions> simulation_;
  Schedule recorded_;
};

}  // namespace cutproof::gpu
