#include "model/io/atomic_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <system_error>

#include "model/error.h"

namespace cutproof::io {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
  // Only reached on the way out of an error; the good paths close, and check, themselves.
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string reason(int error) { return std::error_code(error, std::generic_category()).message(); }

// The file that `path` stands for: the target of a symbolic link, so that the link survives a rename.
std::string resolved(const std::string& path) {
  std::error_code error;
  if (!fs::is_symlink(fs::symlink_status(path, error))) return path;
  const fs::path target = fs::weakly_canonical(path, error);
  return error ? path : target.string();
}

void require_writable_folder(const std::string& path) {
  if (path.empty()) throw InputError("output", "", "The name of the file to write is empty.", "Give a file name.");
  std::error_code error;
  if (fs::is_directory(path, error) || fs::path(path).filename().empty()) {
    throw InputError(path, "", "This is the name of a folder; a file name is needed.",
                     "Give a file name inside the folder.");
  }
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) folder = ".";
  if (!fs::is_directory(folder, error)) {
    throw InputError(path, "", fmt::format("The folder \"{}\" does not exist.", folder.string()),
                     "Make the folder first, or write somewhere else.");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    throw InputError(path, "",
                     fmt::format("The folder \"{}\" cannot be written to: {}.", folder.string(), reason(errno)),
                     "Change its permissions, or write somewhere else.");
  }
}

// Where the file is written that replaces `path`; empty: it is written as it stands.
std::string temporary_of(const std::string& path) {
  require_writable_folder(path);
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) return {};
  const fs::path folder = fs::path(path).parent_path();
  remove_left_behind(folder.empty() ? "." : folder);
  return unfinished_name(path);
}

}  // namespace

AtomicFile::AtomicFile(std::string path) : path_(resolved(path)), unfinished_(temporary_of(path_)) {}

void AtomicFile::commit() {
  if (!unfinished_.path().empty() && std::rename(unfinished_.path().c_str(), path_.c_str()) != 0) {
    throw MachineError(fmt::format("{}: The finished file could not be given its name: {}.", path_, reason(errno)));
  }
  unfinished_.keep();
}

void write_text(const std::string& path, const std::string& text) {
  AtomicFile target(path);
  File file(std::fopen(target.temporary().c_str(), "wb"));
  if (!file) {
    const int error = errno;
    if (error == ENOMEM) throw std::bad_alloc();
    if (error == EACCES || error == EPERM || error == EROFS || error == ENOENT || error == ENAMETOOLONG) {
      throw InputError(path, "", fmt::format("The file cannot be created: {}.", reason(error)),
                       "Write to another folder or under another name.");
    }
    throw MachineError(fmt::format("{}: The file cannot be created: {}.", path, reason(error)));
  }
  const bool written = std::fwrite(text.data(), 1, text.size(), file.get()) == text.size();
  const int write_error = errno;
  // Closing writes what is still buffered, so a full disk may show only here.
  const bool closed = std::fclose(file.release()) == 0;
  if (!written || !closed) {
    throw MachineError(
        fmt::format("{}: The file could not be written to the end: {}.", path, reason(written ? errno : write_error)));
  }
  target.commit();
}

}  // namespace cutproof::io
