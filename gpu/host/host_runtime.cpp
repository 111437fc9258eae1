#include "gpu/host/host_runtime.h"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "model/error.h"

namespace cutproof::gpu {

// The operating-system threads beside the caller's; they wait between launches.
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

int HostRuntime::choose(int count, int current) {
  if (simulation_ == nullptr) throw std::logic_error("HostRuntime: threads follow no schedule.");
  const std::uint32_t mask = (1u << count) - 1;
  const Candidates candidates{{&mask, 1}, current};
  const int chosen = simulation_->schedule(candidates);
  if (simulation_->record) recorded_.push_back(static_cast<std::uint16_t>(candidates.rank(chosen)));
  return chosen;
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
