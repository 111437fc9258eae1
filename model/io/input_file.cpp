#include "model/io/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <string_view>
#include <system_error>

#include "model/error.h"
#include "model/io/limits.h"

namespace cutproof::io {
namespace {

std::string reason_of(int error) { return std::error_code(error, std::generic_category()).message(); }

class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

[[noreturn]] void fail_to_open(const std::string& path, int error) {
  if (error == ENOMEM) throw std::bad_alloc();
  if (error == EMFILE || error == ENFILE) {
    throw MachineError(fmt::format("{}: The file cannot be opened: {}.", path, reason_of(error)));
  }
  if (error == ENOENT) {
    throw InputError(path, "", "There is no such file.", "Check the name and the folder.");
  }
  throw InputError(path, "", fmt::format("The file cannot be opened: {}.", reason_of(error)),
                   "Check its name and its permissions.");
}

void require_regular(const std::string& path, const struct stat& status) {
  if (S_ISREG(status.st_mode)) return;
  const auto refuse = [&](const char* problem, const char* remedy) { throw InputError(path, "", problem, remedy); };
  if (S_ISDIR(status.st_mode)) refuse("This is a folder; a file is needed.", "Give a file inside it.");
  if (S_ISFIFO(status.st_mode)) {
    refuse("This is a pipe; a file is needed.",
           "Write the output into a file first: COMMAND > FILE, not <(COMMAND) and not COMMAND |.");
  }
  if (S_ISSOCK(status.st_mode)) refuse("This is a socket; a file is needed.", "Give the name of a file.");
  refuse("This is a device; a file is needed.", "Give the name of a file.");
}

[[noreturn]] void fail_too_large(const std::string& path, std::string_view what, uint64_t most) {
  throw InputError(path, "", fmt::format("The file is too large. {} has at most {}.", what, bytes_text(most)),
                   "Check that this is the intended file, or make it smaller (docs/reference/limits.md).");
}

}  // namespace

uint64_t require_regular_file(const std::string& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) fail_to_open(path, errno);
  require_regular(path, status);
  return static_cast<uint64_t>(status.st_size);
}

std::string read_file(const std::string& path, std::string_view what, uint64_t most) {
  if (require_regular_file(path) > most) fail_too_large(path, what, most);
  // The file may have been replaced: opening it must not wait.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (file.get() < 0) fail_to_open(path, errno);
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) fail_to_open(path, errno);
  require_regular(path, status);
  std::string text;
  text.reserve(static_cast<std::size_t>(std::min<uint64_t>(static_cast<uint64_t>(status.st_size), most)) + 1);
  char block[1 << 16];
  for (;;) {
    const ssize_t count = ::read(file.get(), block, sizeof block);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      if (error == ENOMEM) throw std::bad_alloc();
      throw InputError(path, "", fmt::format("The file cannot be read to the end: {}.", reason_of(error)),
                       "Check that the file is complete and its disk works.");
    }
    if (count == 0) return text;
    if (static_cast<uint64_t>(count) > most - text.size()) fail_too_large(path, what, most);
    text.append(block, static_cast<std::size_t>(count));
  }
}

std::string read_file(const std::string& path, const JsonLimits& limits) {
  return read_file(path, limits.what, limits.bytes);
}

}  // namespace cutproof::io
