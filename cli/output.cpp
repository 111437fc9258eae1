#include "cli/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "cli/interruption.h"
#include "cli/options.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_text.h"

namespace cutproof::cli {

void flush_output() {
  errno = 0;
  const bool failed = std::fflush(stdout) != 0;
  const int why = errno;
  if ((!failed && std::ferror(stdout) == 0) || (why == EPIPE && stop_asked())) return;
  throw MachineError(std::string("standard output cannot be written to") +
                     (why != 0 ? std::string(": ") + std::strerror(why) : ""));
}

void require_writable(const std::string& path) {
  if (!path.empty()) io::AtomicFile{path};
}

void make_folder(const std::string& option, const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::create_directories(path, error);
  if (!fs::is_directory(path)) {
    refuse(option, fmt::format("the folder '{}' cannot be made: {}", path, error ? error.message() : "it is a file"),
           "give another one");
  }
  if (access(path.c_str(), W_OK | X_OK) != 0) {
    refuse(option, fmt::format("the folder '{}' cannot be written to: {}", path, std::strerror(errno)),
           "change its permissions, or give another one");
  }
}

void write_document(const std::string& path, const nlohmann::json& document) {
  if (!path.empty()) io::write_text(path, io::json_text(document, 1) + "\n");
}

}  // namespace cutproof::cli
