// One operating-system thread that executes blocks of a launch: barriers, collectives, shared memory, and the order of
// threads, fixed or by a simulated schedule.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "gpu/host/kernel_fault.h"
#include "gpu/host/live_block.h"
#include "gpu/host/thread_schedule.h"

namespace cutproof::gpu {

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

  // Executes blocks of `job`, taken from `next`, until none are left or `failed` is set. Sets `failed` and keeps the
  // exception if a thread throws or breaks a rule; never throws.
  void run(const Job& job, std::atomic<int>& next, std::atomic<bool>& failed, bool alone);
  // As run, but simulated; all blocks from 0 on.
  void simulate(const Job& job, SimulationOptions& options, ThreadSchedule& recorded);

  // The failure of the last run, and its block; null: none.
  std::exception_ptr error;
  int error_block = -1;

  // For HostBlock.
  bool simulated() const { return simulation_ != nullptr; }
  bool alone() const { return alone_; }  // no other operating-system thread touches memory now: atomics may be plain
  const Job& job() const { return *job_; }
  void before_access(LiveBlock& block, int thread) {
    if (simulation_ != nullptr) yield(block, thread);
  }
  // Whether `thread` is the last to arrive; it then writes the results and calls release. Other threads call wait.
  bool arrive(LiveBlock& block, int thread, const Meeting& meeting);
  void release(LiveBlock& block, int thread);
  void wait(LiveBlock& block);
  void* shared(LiveBlock& block, int thread, std::size_t bytes);
  [[noreturn]] void fault(const LiveBlock& block, int thread, const std::string& what) const;

 private:
  friend struct Runner;
  struct Next {
    LiveBlock* block;  // null: nothing is left to do
    int thread;
  };
  void yield(LiveBlock& block, int thread);
  void go(int live_blocks);
  void go_alone();
  void prepare(int live_blocks);
  bool start_block(LiveBlock& block);
  Next pick();
  void enter(Next next);
  void switch_to(Runner& to);
  void loop(Runner& self);
  void check_progress(LiveBlock& block);
  void fail(const LiveBlock& block, std::exception_ptr what);
  Runner* free_runner();

  std::vector<std::unique_ptr<LiveBlock>> blocks_;
  std::vector<std::uint32_t> runnable_;  // by place: threads that are not started or can continue
  std::vector<std::unique_ptr<Runner>> runners_;
  std::vector<Runner*> free_;
  std::unique_ptr<Runner> main_;  // the operating-system thread that called run
  Runner* current_ = nullptr;

  const Job* job_ = nullptr;
  std::atomic<int>* next_ = nullptr;
  std::atomic<bool>* failed_ = nullptr;
  bool alone_ = true;

  SimulationOptions* simulation_ = nullptr;
  ThreadSchedule* recorded_ = nullptr;
  std::int64_t steps_ = 0;
  int last_thread_ = 0;
};

}  // namespace cutproof::gpu
