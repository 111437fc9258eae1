#include "gpu/host/turns.h"

#include <string>
#include <system_error>
#include <thread>

#include "model/error.h"

namespace cutproof::gpu {

void Turns::run(const std::function<void()>& first, const std::function<void()>& second) {
  std::thread other;
  try {
    other = std::thread([&] {
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return going_ == 1; });
      }
      carry_out(1, second);
    });
  } catch (const std::system_error& error) {
    throw MachineError("The machine cannot start a thread for the kernels: " + error.code().message() + '.');
  }
  carry_out(0, first);
  other.join();
  if (error_ != nullptr) std::rethrow_exception(error_);
}

void Turns::next() {
  std::unique_lock lock(mutex_);
  const int own = going_;
  if (ended_[1 - own] || awaited_) return;
  const int chosen = choose_(own);
  if (chosen != own) let(chosen, lock);
}

void Turns::arrive() {
  const std::lock_guard lock(mutex_);
  arrived_ = true;
  awaited_ = false;
}

void Turns::await() {
  std::unique_lock lock(mutex_);
  if (arrived_) return;
  awaited_ = true;
  let(0, lock);
}

// Returns when the running piece lets this one continue.
void Turns::let(int piece, std::unique_lock<std::mutex>& lock) {
  const int own = going_;
  going_ = piece;
  changed_.notify_all();
  changed_.wait(lock, [&] { return going_ == own; });
  if (error_ != nullptr) throw Abandoned{};
}

void Turns::carry_out(int piece, const std::function<void()>& work) {
  std::exception_ptr error;
  try {
    const bool failed = [&] {
      const std::lock_guard lock(mutex_);
      return error_ != nullptr;
    }();
    if (!failed) work();
  } catch (const Abandoned&) {
  } catch (...) {
    error = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  if (error_ == nullptr) error_ = error;
  ended_[piece] = true;
  if (!ended_[1 - piece]) going_ = 1 - piece;
  changed_.notify_all();
}

}  // namespace cutproof::gpu
