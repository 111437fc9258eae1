#include "gpu/host/host_runtime.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <boost/context/detail/fcontext.hpp>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include "gpu/host/host_block.h"
#include "model/error.h"

#if defined(__SANITIZE_ADDRESS__)
#define CUTPROOF_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define CUTPROOF_ASAN 1
#endif
#endif
#if defined(__SANITIZE_THREAD__)
#define CUTPROOF_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define CUTPROOF_TSAN 1
#endif
#endif
#ifdef CUTPROOF_ASAN
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#endif
#ifdef CUTPROOF_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace cutproof::gpu {

namespace context = boost::context::detail;

// A stack to execute on. The one of the operating-system thread that called run has no mapping of its own.
struct Fibre {
  Worker* worker = nullptr;
  context::fcontext_t at = nullptr;  // where it goes on; null: it has not begun
  void* mapping = nullptr;
  std::size_t mapped = 0;
  void* bottom = nullptr;  // of the stack proper, above the guard page
  std::size_t bytes = 0;
  LiveBlock* block = nullptr;  // what to execute next
  int thread = 0;
  void* fake_stack = nullptr;  // AddressSanitizer's
  void* tsan = nullptr;        // ThreadSanitizer's

  Fibre() = default;
  ~Fibre();
  Fibre(const Fibre&) = delete;
  Fibre& operator=(const Fibre&) = delete;

  static void begin(context::transfer_t from);
  void arrived(context::fcontext_t from);
};

namespace {

constexpr std::size_t kStackBytes = 256 * 1024;  // address space; only touched pages take memory

// Thrown through the threads of a launch that has failed, to unwind their stacks.
struct Unwind {};

std::uint32_t bit(int thread) { return 1u << thread; }

std::unique_ptr<Fibre> make_fibre(Worker* worker) {
  auto fibre = std::make_unique<Fibre>();
  fibre->worker = worker;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* const mapping = mmap(nullptr, kStackBytes + page, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
  if (mapping == MAP_FAILED) throw std::bad_alloc();
  fibre->mapping = mapping;
  fibre->mapped = kStackBytes + page;
  // Stacks grow downwards: running over the end is a segmentation fault, not silent damage.
  if (mprotect(fibre->mapping, page, PROT_NONE) != 0) throw std::bad_alloc();
  fibre->bottom = static_cast<std::byte*>(fibre->mapping) + page;
  fibre->bytes = kStackBytes;
  fibre->at =
      context::make_fcontext(static_cast<std::byte*>(fibre->bottom) + fibre->bytes, fibre->bytes, &Fibre::begin);
#ifdef CUTPROOF_TSAN
  fibre->tsan = __tsan_create_fiber(0);
#endif
  return fibre;
}

bool same(const Meeting& a, const Meeting& b) {
  return a.operation == b.operation && a.mask == b.mask && a.where.line == b.where.line &&
         (a.where.file == b.where.file || std::strcmp(a.where.file, b.where.file) == 0);
}

const char* name(Operation operation) {
  switch (operation) {
    case Operation::sync:
      return "sync";
    case Operation::sum:
      return "sum";
    case Operation::warp_sum:
      return "warp_sum";
    case Operation::smallest:
      return "smallest";
    case Operation::any:
      return "any";
    case Operation::exclusive_scan:
      return "exclusive_scan";
    case Operation::ballot:
      return "ballot";
    case Operation::shuffle:
      return "shuffle";
  }
  return "?";
}

bool of_warp(Operation operation) { return operation == Operation::ballot || operation == Operation::shuffle; }

// "threads 0-3,7"
std::string list(std::uint32_t mask) {
  std::string text = std::popcount(mask) == 1 ? "thread " : "threads ";
  bool first = true;
  while (mask != 0) {
    const int begin = std::countr_zero(mask);
    const int length = std::countr_one(mask >> begin);
    if (!first) text += ',';
    first = false;
    text += std::to_string(begin);
    if (length > 1) text += '-' + std::to_string(begin + length - 1);
    mask = length == 32 ? 0 : mask & ~(((1u << length) - 1) << begin);
  }
  return text;
}

std::string describe(const Meeting& meeting) {
  const char* file = meeting.where.file;
  const char* slash = std::strrchr(file, '/');
  std::string text = name(meeting.operation);
  if (of_warp(meeting.operation)) {
    char mask[16];
    std::snprintf(mask, sizeof mask, "0x%08x", meeting.mask);
    text += std::string(" with mask ") + mask;
  }
  return text + " (" + (slash != nullptr ? slash + 1 : file) + ':' + std::to_string(meeting.where.line) + ')';
}

std::string place_of(const Job& job, const LiveBlock& block) {
  return std::string(job.kernel) + ", block " + std::to_string(block.index) + " of " + std::to_string(job.blocks);
}

// Who waits where when nobody can go on.
std::string describe_stop(const Job& job, const LiveBlock& block) {
  std::string text = place_of(job, block) + ": not all threads that must meet do:";
  std::uint32_t rest = block.waiting;
  while (rest != 0) {
    const Meeting& meeting = block.meeting[std::countr_zero(rest)];
    std::uint32_t group = 0;
    for (int t = 0; t < kHostThreads; ++t) {
      if ((rest & bit(t)) != 0 && same(block.meeting[t], meeting)) group |= bit(t);
    }
    text.append(" ").append(list(group)).append(" at ").append(describe(meeting)).append(";");
    rest &= ~group;
  }
  if (block.done != 0) text.append(" ").append(list(block.done)).append(" ended;");
  text.back() = '.';
  return text;
}

}  // namespace

Fibre::~Fibre() {
  if (mapping == nullptr) return;
#ifdef CUTPROOF_ASAN
  if (bottom != nullptr) ASAN_UNPOISON_MEMORY_REGION(bottom, bytes);
#endif
#ifdef CUTPROOF_TSAN
  if (tsan != nullptr) __tsan_destroy_fiber(tsan);
#endif
  munmap(mapping, mapped);
}

// What must be told to the sanitizers when a stack is entered.
void Fibre::arrived(context::fcontext_t from) {
  worker->previous_->at = from;
#ifdef CUTPROOF_ASAN
  const void* bottom_before = nullptr;
  std::size_t bytes_before = 0;
  __sanitizer_finish_switch_fiber(fake_stack, &bottom_before, &bytes_before);
  if (worker->previous_->mapping == nullptr) {
    worker->previous_->bottom = const_cast<void*>(bottom_before);
    worker->previous_->bytes = bytes_before;
  }
#endif
}

void Fibre::begin(context::transfer_t from) {
  auto* self = static_cast<Fibre*>(from.data);
  self->arrived(from.fctx);
  self->worker->loop(self);
}

Worker::Worker() : main_(std::make_unique<Fibre>()) { main_->worker = this; }

Worker::~Worker() = default;

void Worker::switch_to(Fibre* to) {
  Fibre* self = current_;
  previous_ = self;
  current_ = to;
#ifdef CUTPROOF_ASAN
  __sanitizer_start_switch_fiber(&self->fake_stack, to->bottom, to->bytes);
#endif
#ifdef CUTPROOF_TSAN
  __tsan_switch_to_fiber(to->tsan, 0);
#endif
  const context::transfer_t back = context::jump_fcontext(to->at, to);
  self->arrived(back.fctx);
}

Fibre* Worker::free_fibre() {
  if (free_.empty()) {
    fibres_.push_back(make_fibre(this));
    // Here, because a fibre gives itself back where nothing may be thrown.
    free_.reserve(fibres_.capacity());
    return fibres_.back().get();
  }
  Fibre* fibre = free_.back();
  free_.pop_back();
  return fibre;
}

// Takes the next block of the launch into this place; false: there is none.
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

// Executes the launch with up to `live_blocks` blocks at once. Never throws: other workers may be at it.
void Worker::go(int live_blocks) {
  error = nullptr;
  error_block = -1;
  current_ = main_.get();
#ifdef CUTPROOF_TSAN
  main_->tsan = __tsan_get_current_fiber();
#endif
  try {
    prepare(live_blocks);
    const Next next = pick();
    if (next.block != nullptr) enter(next);
  } catch (...) {  // no memory
    error = std::current_exception();
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
  go(1);
}

void Worker::simulate(const Job& job, SimulationOptions& options, Schedule& recorded) {
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

// Who goes on, taken out of the runnable; starts new blocks in the places of those that have ended.
Worker::Next Worker::pick() {
  if (simulation_ == nullptr && runnable_[0] != 0) {  // as below, for the one block that there is
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

// Goes on with `next`: on a free stack if it has not started, otherwise on its own. Returns when the caller is resumed.
void Worker::enter(Next next) {
  LiveBlock& block = *next.block;
  Fibre* to = block.fibre[next.thread];
  if ((block.started & bit(next.thread)) == 0) {
    to = free_fibre();
    to->block = &block;
    to->thread = next.thread;
  }
  switch_to(to);
}

// What a fibre does all its life: execute threads, one after the other.
void Worker::loop(Fibre* self) {
  for (;;) {
    LiveBlock& block = *self->block;
    const int thread = self->thread;
    block.started |= bit(thread);
    block.fibre[thread] = self;
    try {
      HostBlock seen(*this, block, thread);
      job_->run(job_->call, seen);
    } catch (const Unwind&) {
    } catch (...) {
      fail(block, std::current_exception());
    }
    block.done |= bit(thread);
    block.fibre[thread] = nullptr;
    Next next{nullptr, 0};
    try {
      check_progress(block);
      next = pick();
    } catch (...) {  // no memory for a fault's text or for a choice; nothing is above this frame to catch it
      fail(block, std::current_exception());
      next = pick();  // asks nobody now
    }
    if (next.block == nullptr) {
      free_.push_back(self);
      switch_to(main_.get());
    } else if ((next.block->started & bit(next.thread)) == 0) {
      self->block = next.block;
      self->thread = next.thread;
    } else {
      free_.push_back(self);
      switch_to(next.block->fibre[next.thread]);
    }
  }
}

// Called when a thread has stopped for good or waits: if nobody else of its block can go on, nobody ever will.
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

// Operating-system threads beside the caller's, which wait between launches.
struct HostRuntime::Pool {
  std::mutex mutex;
  std::condition_variable wake, finished;
  const Job* job = nullptr;
  std::atomic<int> next{0};
  std::atomic<bool> failed{false};
  long launch = 0;
  int busy = 0;
  bool stop = false;
  std::vector<std::thread> threads;

  void serve(Worker& worker) {
    long seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stop || launch != seen; });
      if (stop) return;
      seen = launch;
      lock.unlock();
      worker.run(*job, next, failed, false);
      lock.lock();
      if (--busy == 0) finished.notify_one();
    }
  }
  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    wake.notify_all();
    for (std::thread& thread : threads) thread.join();
  }
};

HostRuntime::HostRuntime(int threads) {
  if (threads < 1)
    throw std::invalid_argument("HostRuntime: needs at least one thread, not " + std::to_string(threads));
  for (int i = 0; i < threads; ++i) workers_.push_back(std::make_unique<Worker>());
  if (threads == 1) return;
  pool_ = std::make_unique<Pool>();
  try {
    for (int i = 1; i < threads; ++i) {
      pool_->threads.emplace_back([pool = pool_.get(), worker = workers_[i].get()] { pool->serve(*worker); });
    }
  } catch (const std::system_error& error) {
    throw MachineError("The machine cannot start " + std::to_string(threads - 1) +
                       " threads for the kernels: " + error.code().message() + '.');
  }
}

HostRuntime::HostRuntime(SimulationOptions simulation)
    : simulation_(std::make_unique<SimulationOptions>(std::move(simulation))) {
  if (!simulation_->schedule) throw std::invalid_argument("HostRuntime: a simulation needs a schedule.");
  if (simulation_->live_blocks < 1 || simulation_->live_blocks > 2048) {
    throw std::invalid_argument("HostRuntime: 1 to 2048 blocks can be alive at once, not " +
                                std::to_string(simulation_->live_blocks));
  }
  workers_.push_back(std::make_unique<Worker>());
}

HostRuntime::~HostRuntime() { pool_.reset(); }

void HostRuntime::reschedule(Generator schedule) {
  if (simulation_ == nullptr) throw std::logic_error("HostRuntime: threads follow no schedule.");
  simulation_->schedule = std::move(schedule);
  recorded_.clear();
}

void HostRuntime::run(const Job& job) {
  Worker& own = *workers_.front();
  if (simulation_ != nullptr) {
    own.simulate(job, *simulation_, recorded_);
    if (own.error != nullptr) std::rethrow_exception(std::exchange(own.error, nullptr));
    return;
  }
  if (pool_ == nullptr || job.blocks == 1) {
    std::atomic<int> next{0};
    std::atomic<bool> failed{false};
    own.run(job, next, failed, true);
    if (own.error != nullptr) std::rethrow_exception(std::exchange(own.error, nullptr));
    return;
  }
  {
    const std::lock_guard lock(pool_->mutex);
    pool_->job = &job;
    pool_->next = 0;
    pool_->failed = false;
    pool_->busy = static_cast<int>(pool_->threads.size());
    ++pool_->launch;
  }
  pool_->wake.notify_all();
  own.run(job, pool_->next, pool_->failed, false);
  {
    std::unique_lock lock(pool_->mutex);
    pool_->finished.wait(lock, [&] { return pool_->busy == 0; });
  }
  std::exception_ptr first;
  int first_block = 0;
  for (const auto& worker : workers_) {
    if (worker->error == nullptr) continue;
    if (first == nullptr || worker->error_block < first_block) first = worker->error, first_block = worker->error_block;
    worker->error = nullptr;
  }
  if (first != nullptr) std::rethrow_exception(first);
}

}  // namespace cutproof::gpu
