// Files that are either whole or not there.
#pragma once
#include <string>

#include "model/io/unfinished.h"

namespace cutproof::io {

// A name beside `path` to write to; commit() renames it to `path`, and what was not committed is removed: by the
// destructor, by a signal (Unfinished), or by the next program that writes into the folder.
// A symbolic link is followed, so it is its target that is replaced. A `path` that exists and is no regular file
// (a pipe, /dev/stdout) cannot be replaced: temporary() is then `path` itself and commit() does nothing.
class AtomicFile {
 public:
  // Throws InputError if the folder is not there or not writable, or if `path` names a folder.
  explicit AtomicFile(std::string path);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  const std::string& temporary() const { return unfinished_.path().empty() ? path_ : unfinished_.path(); }
  void commit();  // throws MachineError if the rename fails

 private:
  std::string path_;
  Unfinished unfinished_;
};

// Throws InputError if the folder is not there or not writable, MachineError if the disk fails.
void write_text(const std::string& path, const std::string& text);

}  // namespace cutproof::io
