#include "model/io/unfinished.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "model/digest.h"

namespace cutproof::io {
namespace {

namespace fs = std::filesystem;

// A list without allocations, because it is gone through when there is no memory, and by signal handlers. While a
// thread holds it, no handler interrupts that thread: one that waited for it would wait for ever.
std::atomic_flag held = ATOMIC_FLAG_INIT;
Unfinished* living = nullptr;

class Held {
 public:
  Held() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
    while (held.test_and_set(std::memory_order_acquire)) sched_yield();
  }
  ~Held() {
    held.clear(std::memory_order_release);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

 private:
  sigset_t before_ = {};
};

// Says which processes a number stands for: those of this installation, under this name, in this namespace. Folders are
// shared between machines, and between containers.
std::string machine_tag() {
  std::string id;
  std::getline(std::ifstream("/etc/machine-id"), id);
  utsname name = {};
  uname(&name);
  std::error_code error;
  Digest digest;
  digest.add(std::string_view(id));
  digest.add(std::string_view(name.nodename));
  digest.add(std::string_view(fs::read_symlink("/proc/self/ns/pid", error).native()));
  return fmt::format("{:08x}", digest.value() >> 32);
}

// The number that `text` is, or begins with before `end`; takes it off. Negative: none.
int64_t take_number(std::string_view& text, char end) {
  int64_t number = -1;
  const auto [after, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto length = static_cast<std::size_t>(after - text.data());
  if (error != std::errc() || length >= text.size() || text[length] != end) return -1;
  text.remove_prefix(length + 1);
  return number;
}

// The ending of names of this machine.
std::string name_tail() { return fmt::format("-{}.tmp", machine_tag()); }

// The process that has left a file of this name, as unfinished_name() makes them on this machine; 0: it is another.
int64_t process_of(std::string_view name, std::string_view tail) {
  if (!name.starts_with('.') || !name.ends_with(tail)) return 0;
  name.remove_suffix(tail.size() - 1);  // ends with '-'
  const std::size_t dot = name.rfind('.');
  if (dot < 2) return 0;  // nothing before it but the first one
  std::string_view numbers = name.substr(dot + 1);
  const int64_t process = take_number(numbers, '-'), count = take_number(numbers, '-');
  return process > 0 && process <= INT32_MAX && count >= 0 && numbers.empty() ? process : 0;
}

}  // namespace

Unfinished::Unfinished(std::string path) : path_(std::move(path)) {
  const Held now;
  next_ = living;
  if (next_ != nullptr) next_->previous_ = this;
  living = this;
}

Unfinished::~Unfinished() {
  remove();
  const Held now;
  (previous_ != nullptr ? previous_->next_ : living) = next_;
  if (next_ != nullptr) next_->previous_ = previous_;
}

void Unfinished::remove() noexcept {
  if (kept_ || path_.empty()) return;
  if (::unlink(path_.c_str()) != 0 && errno == EISDIR) ::rmdir(path_.c_str());
}

void Unfinished::remove_all() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);
  while (held.test_and_set(std::memory_order_acquire)) sched_yield();
  for (Unfinished* file = living; file != nullptr; file = file->next_) file->remove();
}

std::string unfinished_name(const fs::path& path) {
  static std::atomic<unsigned> count{0};
  const std::string name = fmt::format(".{}.{}-{}{}", path.filename().string(), ::getpid(), count++, name_tail());
  return (path.parent_path() / name).string();
}

void remove_left_behind(const fs::path& folder) {
  const std::string tail = name_tail();
  // Not directory_iterator: where there is no memory for a name, libstdc++ ends the program instead of throwing.
  struct Close {
    void operator()(DIR* open) const { ::closedir(open); }
  };
  const std::unique_ptr<DIR, Close> entries(::opendir(folder.c_str()));
  if (entries == nullptr) return;
  while (const dirent* const entry = ::readdir(entries.get())) {
    const auto process = static_cast<pid_t>(process_of(entry->d_name, tail));
    if (process == 0 || ::kill(process, 0) == 0 || errno != ESRCH) continue;
    ::unlinkat(::dirfd(entries.get()), entry->d_name, 0);
  }
}

}  // namespace cutproof::io
