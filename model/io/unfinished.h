// Files that must not outlive their writer, whatever ends it: an error, a signal, a kill.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>

namespace cutproof::io {

// A file, or an empty folder, that goes with this object.
class Unfinished {
 public:
  explicit Unfinished(std::string path);  // empty: nothing
  ~Unfinished();
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  const std::string& path() const { return path_; }
  void keep() noexcept { kept_ = true; }

  // For a program that ends without unwinding: removes all of these, in the order opposite to that in which they were
  // made. May be called by a signal handler, of any thread. The program must end then: no other thread makes or removes
  // one any more.
  static void remove_all() noexcept;

 private:
  void remove() noexcept;
  std::string path_;
  std::atomic<bool> kept_ = false;
  Unfinished *previous_ = nullptr, *next_ = nullptr;  // of all that live
};

// Temporary name of `path`, beside it: ".NAME.PID-NUMBER-MACHINE.tmp". Two processes, and two writers in one process,
// never share a name.
std::string unfinished_name(const std::filesystem::path& path);
// Removes what processes that were killed, or lost their power, have left in a folder: files of such names whose
// process does not live, on this machine (and among the processes that this one sees). Other files stay, and those that
// cannot be removed.
void remove_left_behind(const std::filesystem::path& folder);

}  // namespace cutproof::io
