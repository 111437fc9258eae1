// Two pieces of work that take turns, launch by launch, by a choice: HostLauncher::side_by_side under a simulated
// schedule. Each has an operating-system thread; one runs at a time.
#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <utility>

namespace cutproof::gpu {

class Turns {
 public:
  // choose(current): which of 0 and 1 continues, while neither has ended.
  explicit Turns(std::function<int(int current)> choose) : choose_(std::move(choose)) {}

  // Executes both, and rethrows the first exception. Throws MachineError if the system refuses a thread.
  void run(const std::function<void()>& first, const std::function<void()>& second);
  // Called by the running piece before each of its launches: lets the other one continue if chosen.
  void next();
  // arrive(): the first piece lets the second pass await(). await(): the second lets the first run until then.
  void arrive();
  void await();

 private:
  struct Abandoned {};  // ends a piece after the other one has failed
  void carry_out(int piece, const std::function<void()>& work);
  void let(int piece, std::unique_lock<std::mutex>& lock);

  std::function<int(int)> choose_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int going_ = 0;
  bool ended_[2] = {};
  bool arrived_ = false, awaited_ = false;  // awaited_: the second piece waits for the first to arrive
  std::exception_ptr error_;
};

}  // namespace cutproof::gpu
