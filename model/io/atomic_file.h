// Files that are either whole or not there.
#pragma once
#include <string>

namespace cutproof::io {

// A name beside `path` to write to; commit() renames it to `path`, the destructor removes what was not committed.
// A symbolic link is followed, so it is its target that is replaced. A `path` that exists and is no regular file
// (a pipe, /dev/stdout) cannot be replaced: temporary() is then `path` itself and commit() does nothing.
class AtomicFile {
 public:
  // Throws InputError if the folder is not there or not writable, or if `path` names a folder.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  const std::string& temporary() const { return temporary_; }
  void commit();  // throws MachineError if the rename fails
  // For a program that ends without unwinding: removes what every AtomicFile of the process has not committed.
  // Allocates nothing. No other thread may be making or destroying one.
  static void remove_unfinished() noexcept;

 private:
  void remove_temporary() noexcept;
  std::string path_, temporary_;
  bool committed_ = false;
  AtomicFile *previous_ = nullptr, *next_ = nullptr;  // of all that live
};

// Throws InputError if the folder is not there or not writable, MachineError if the disk fails.
void write_text(const std::string& path, const std::string& text);

}  // namespace cutproof::io
