// Two pieces of work that take turns, launch by launch, as somebody chooses: what HostLauncher::side_by_side does under
// a simulated schedule. Each has an operating-system thread, of which one goes at a time.
#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <utility>

namespace cutproof::gpu {

class Turns {
 public:
  // choose(current): which of 0 and 1 goes on, while neither has ended.
  explicit Turns(std::function<int(int current)> choose) : choose_(std::move(choose)) {}

  // Carries out both, and throws what the first one threw that threw. Throws MachineError if the system refuses a
  // thread.
  void run(const std::function<void()>& first, const std::function<void()>& second);
  // By the piece that goes, before each of its launches: lets the other one go on if it is chosen.
  void next();
  // By the first piece, where the second one may pass await(); by the second one: the first goes on until then.
  void arrive();
  void await();

 private:
  struct Abandoned {};  // leads out of a piece when the other one has failed
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
