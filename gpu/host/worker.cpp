#include "gpu/host/worker.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "gpu/host/fibre.h"
#include "gpu/host/host_block.h"
#include "gpu/host/sanitizers.h"

namespace cutproof::gpu {

namespace {

// Thrown through the threads of a launch that has failed, to unwind their stacks.
struct Unwind {};

}  // namespace

// A fibre that executes threads of blocks.
struct Runner {
  Worker* worker = nullptr;
  LiveBlock* block = nullptr;  // to execute next
  int thread = 0;
  Fibre fibre;

  Runner() = default;
  explicit Runner(Worker* of)
      : worker(of),
        fibre(
            [](void* runner) {
              auto& self = *static_cast<Runner*>(runner);
              self.worker->loop(self);
            },
            this) {}
};

Worker::Worker() : main_(std::make_unique<Runner>()) {}

Worker::~Worker() = default;

void Worker::switch_to(Runner& to) {
  Runner& self = *current_;
  current_ = &to;
  self.fibre.switch_to(to.fibre);
}

Runner* Worker::free_runner() {
  if (free_.empty()) {
    runners_.push_back(std::make_unique<Runner>(this));
    // Reserved here, because a runner returns itself where nothing may be thrown.
    free_.reserve(runners_.capacity());
    return runners_.back().get();
  }
  Runner* runner = free_.back();
  free_.pop_back();
  return runner;
}

// Starts the launch's next block in this place; false: there is none.
bool Worker::start_block(LiveBlock& block) {
  if (failed_->load(std::memory_order_relaxed) || next_->load(std::memory_order_relaxed) >= job_->blocks) return false;
  const int index = next_->fetch_add(1, std::memory_order_relaxed);
  if (index >= job_->blocks) return false;
  block.index = index;
  block.started = block.waiting = block.done = 0;
  block.cancelled = false;
  if (!block.requests.empty()) {
    block.requests.clear();
    block.shared_used = 0;
    std::fill(std::begin(block.requested), std::end(block.requested), std::size_t{0});
#ifdef CUTPROOF_ASAN
    ASAN_POISON_MEMORY_REGION(block.shared.get(), block.shared_capacity);
#endif
  }
  runnable_[block.place] = LiveBlock::kAll;
  return true;
}

// Executes the launch with up to `live_blocks` blocks at once. Never throws: other workers may be busy with it.
void Worker::go(int live_blocks) {
  error = nullptr;
  error_block = -1;
  current_ = main_.get();
  main_->fibre.announce_thread();
  try {
    prepare(live_blocks);
    const Next next = pick();
    if (next.block != nullptr) enter(next);
  } catch (...) {  // no memory
    error = std::current_exception();
    failed_->store(true, std::memory_order_relaxed);
  }
}

// As go, for blocks of one thread: they run in sequence on the caller's stack.
void Worker::go_alone() {
  error = nullptr;
  error_block = -1;
  try {
    prepare(1);
    LiveBlock& block = *blocks_.front();
    while (start_block(block)) {
      HostBlock seen(*this, block, 0);
      job_->run(job_->call, seen);
    }
  } catch (...) {
    error = std::current_exception();
    error_block = blocks_.empty() ? -1 : blocks_.front()->index;
    failed_->store(true, std::memory_order_relaxed);
  }
}

void Worker::prepare(int live_blocks) {
  if (runnable_.size() < static_cast<std::size_t>(live_blocks)) runnable_.resize(live_blocks);
  while (static_cast<int>(blocks_.size()) < live_blocks) {
    blocks_.push_back(std::make_unique<LiveBlock>());
    blocks_.back()->place = static_cast<int>(blocks_.size()) - 1;
  }
  for (const auto& block : blocks_) {
    if (job_->shared_bytes > block->shared_capacity) {
#ifdef CUTPROOF_ASAN
      ASAN_UNPOISON_MEMORY_REGION(block->shared.get(), block->shared_capacity);
#endif
      const std::size_t capacity = (job_->shared_bytes + 15) / 16 * 16;
      block->shared_capacity = 0;
      block->shared = std::make_unique<std::byte[]>(capacity);
      block->shared_capacity = capacity;
    }
    block->requests.assign(1, {});  // so that start_block resets
    block->done = LiveBlock::kAll;
    runnable_[block->place] = 0;
  }
}

void Worker::run(const Job& job, std::atomic<int>& next, std::atomic<bool>& failed, bool alone) {
  job_ = &job;
  next_ = &next;
  failed_ = &failed;
  alone_ = alone;
  simulation_ = nullptr;
  if (job.threads == 1) {
    go_alone();
  } else {
    go(1);
  }
}

void Worker::simulate(const Job& job, SimulationOptions& options, ThreadSchedule& recorded) {
  std::atomic<int> next{0};
  std::atomic<bool> failed{false};
  job_ = &job;
  next_ = &next;
  failed_ = &failed;
  alone_ = true;
  simulation_ = &options;
  recorded_ = &recorded;
  steps_ = 0;
  last_thread_ = 0;
  go(options.live_blocks);
}

// The next thread to run, removed from runnable_; new blocks start in the places of ended ones.
Worker::Next Worker::pick() {
  if (simulation_ == nullptr && runnable_[0] != 0) {  // as below, for the only block
    const int thread = std::countr_zero(runnable_[0]);
    runnable_[0] &= runnable_[0] - 1;
    return {blocks_.front().get(), thread};
  }
  for (const auto& block : blocks_) {
    if (block->done == LiveBlock::kAll && !start_block(*block)) runnable_[block->place] = 0;
  }
  int chosen = -1;
  if (simulation_ == nullptr) {
    if (runnable_[0] != 0) chosen = std::countr_zero(runnable_[0]);
  } else {
    Candidates candidates{runnable_, last_thread_};
    const int count = candidates.count();
    if (count == 1 || (count > 1 && failed_->load(std::memory_order_relaxed))) {
      chosen = candidates.lowest();
    } else if (count > 1) {
      chosen = simulation_->schedule(candidates);
      if (simulation_->record) recorded_->push_back(static_cast<std::uint16_t>(candidates.rank(chosen)));
    }
    if (chosen >= 0) last_thread_ = chosen;
  }
  if (chosen < 0) return {nullptr, 0};
  runnable_[chosen / 32] &= ~bit(chosen % 32);
  return {blocks_[chosen / 32].get(), chosen % 32};
}

// Continues with `next`: on a free stack if it has not started, otherwise on its own. Returns when the caller is
// resumed.
void Worker::enter(Next next) {
  LiveBlock& block = *next.block;
  Runner* to = block.runner[next.thread];
  if ((block.started & bit(next.thread)) == 0) {
    to = free_runner();
    to->block = &block;
    to->thread = next.thread;
  }
  switch_to(*to);
}

// A runner's loop: executes threads, one after the other.
void Worker::loop(Runner& self) {
  for (;;) {
    LiveBlock& block = *self.block;
    const int thread = self.thread;
    block.started |= bit(thread);
    block.runner[thread] = &self;
    try {
      HostBlock seen(*this, block, thread);
      job_->run(job_->call, seen);
    } catch (const Unwind&) {
    } catch (...) {
      fail(block, std::current_exception());
    }
    block.done |= bit(thread);
    block.runner[thread] = nullptr;
    Next next{nullptr, 0};
    try {
      check_progress(block);
      next = pick();
    } catch (...) {  // no memory for a fault's text or for a choice; no frame above catches it
      fail(block, std::current_exception());
      next = pick();  // consults no schedule now
    }
    if (next.block == nullptr) {
      free_.push_back(&self);
      switch_to(*main_);
    } else if ((next.block->started & bit(next.thread)) == 0) {
      self.block = next.block;
      self.thread = next.thread;
    } else {
      free_.push_back(&self);
      switch_to(*next.block->runner[next.thread]);
    }
  }
}

// Called when a thread has ended or waits: if no other thread of its block can run, none ever will.
void Worker::check_progress(LiveBlock& block) {
  if (runnable_[block.place] != 0 || block.waiting == 0) return;
  fail(block, std::make_exception_ptr(KernelFault(describe_stop(*job_, block))));
}

void Worker::fail(const LiveBlock& block, std::exception_ptr what) {
  if (error == nullptr) {
    error = std::move(what);
    error_block = block.index;
  }
  failed_->store(true, std::memory_order_relaxed);
  for (const auto& each : blocks_) {
    if (each->done == LiveBlock::kAll) continue;
    each->cancelled = true;
    each->done |= ~each->started;
    each->waiting = 0;
    runnable_[each->place] = each->started & ~each->done;
    // The running thread is not resumed but ends by itself.
    if (current_->block == each.get()) runnable_[each->place] &= ~bit(current_->thread);
  }
}

bool Worker::arrive(LiveBlock& block, int thread, const Meeting& meeting) {
  if ((meeting.mask & bit(thread)) == 0) fault(block, thread, "calls " + describe(meeting) + ", which leaves it out");
  block.meeting[thread] = meeting;
  if (block.waiting == 0) {
    block.first_waiting = thread;
    block.agreeing = true;
  } else if (block.agreeing) {
    block.agreeing = same(block.meeting[block.first_waiting], meeting);
  }
  block.waiting |= bit(thread);
  if ((block.waiting & meeting.mask) != meeting.mask) return false;
  if (block.agreeing) return true;
  for (std::uint32_t rest = meeting.mask; rest != 0; rest &= rest - 1) {
    if (!same(block.meeting[std::countr_zero(rest)], meeting)) return false;
  }
  return true;
}

void Worker::release(LiveBlock& block, int thread) {
  const std::uint32_t met = block.meeting[thread].mask;
  block.waiting &= ~met;
  runnable_[block.place] |= met & ~bit(thread);
  before_access(block, thread);
}

void Worker::wait(LiveBlock& block) {
  check_progress(block);
  if (!block.cancelled) {
    enter(pick());
  }
  if (block.cancelled) throw Unwind{};
}

void Worker::yield(LiveBlock& block, int thread) {
  if (++steps_ > simulation_->step_budget) {
    throw KernelFault(place_of(*job_, block) + ": livelock: the launch did not end within " +
                      std::to_string(simulation_->step_budget) + " steps; it was " + list(bit(thread)) + "'s turn.");
  }
  runnable_[block.place] |= bit(thread);
  const Next next = pick();
  if (next.block == &block && next.thread == thread) return;
  enter(next);
  if (block.cancelled) throw Unwind{};
}

void Worker::fault(const LiveBlock& block, int thread, const std::string& what) const {
  throw KernelFault(place_of(*job_, block) + ": " + list(bit(thread)) + " " + what + '.');
}

void* Worker::shared(LiveBlock& block, int thread, std::size_t bytes) {
  const std::size_t number = block.requested[thread]++;
  if (number < block.requests.size()) {
    const LiveBlock::Request& request = block.requests[number];
    if (request.bytes != bytes) {
      fault(block, thread,
            "takes " + std::to_string(bytes) + " bytes of shared memory where another thread took " +
                std::to_string(request.bytes));
    }
    return block.shared.get() + request.offset;
  }
  const std::size_t offset = (block.shared_used + 15) / 16 * 16;
  if (offset + bytes > job_->shared_bytes) {
    fault(block, thread,
          "takes shared memory up to byte " + std::to_string(offset + bytes) + " of the " +
              std::to_string(job_->shared_bytes) + " that the launch granted");
  }
  block.requests.push_back({offset, bytes});
  block.shared_used = offset + bytes;
  std::byte* memory = block.shared.get() + offset;
#ifdef CUTPROOF_ASAN
  ASAN_UNPOISON_MEMORY_REGION(memory, bytes);
#endif
  if (bytes > 0) std::memset(memory, 0xff, bytes);
  return memory;
}

}  // namespace cutproof::gpu
