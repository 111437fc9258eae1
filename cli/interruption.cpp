#include "cli/interruption.h"

#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

#include "model/io/unfinished.h"

namespace cutproof::cli {

namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};

// All that a handler touches.
std::atomic<bool> ends_in_order = false;
std::atomic<int> asking_signal = 0;  // the signal
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

// By the signal itself, so that the waiting process sees the signal.
[[noreturn]] void end_by(int signal) noexcept {
  io::Unfinished::remove_all();
  const rlimit none = {0, 0};
  setrlimit(RLIMIT_CORE, &none);  // QUIT would leave the memory as a file
  ::signal(signal, SIG_DFL);
  sigset_t only;
  sigemptyset(&only);
  sigaddset(&only, signal);
  raise(signal);
  pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
  _exit(128 + signal);  // the first process of a container is not ended by its own signals
}

void say_that_it_stops() {
  constexpr char kText[] =
      "\ncutproof: stopping; the results so far will be written.\n  A second signal ends it at once.\n";
  if (isatty(STDERR_FILENO) == 0) return;
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kText, sizeof kText - 1);
}

void on_signal(int signal) {
  const int before = errno;
  if (!ends_in_order) end_by(signal);
  int none = 0;
  const bool is_first = asking_signal.compare_exchange_strong(none, signal);
  // Each further line for a closed reader brings another PIPE, which is no second request.
  if (!is_first && signal != SIGPIPE) end_by(signal);
  if (is_first && signal != SIGPIPE) say_that_it_stops();
  errno = before;
}

}  // namespace

void handle_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigfillset(&action.sa_mask);
  for (const int signal : kSignals) {
    struct sigaction inherited = {};
    if (sigaction(signal, nullptr, &inherited) == 0 && inherited.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
  // Also where it was ignored: a closed pipe means the end of output, without an error.
  sigaction(SIGPIPE, &action, nullptr);
  ::signal(SIGXFSZ, SIG_IGN);
}

EndsInOrder::EndsInOrder() { ends_in_order = true; }
EndsInOrder::~EndsInOrder() {
  // The caller handles an earlier request; a later signal ends the program at once.
  ends_in_order = false;
}

bool stop_asked() noexcept { return asking_signal != 0; }

void end_by_signal() noexcept { end_by(asking_signal); }

}  // namespace cutproof::cli
