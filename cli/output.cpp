#include "cli/output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "cli/interruption.h"
#include "cli/options.h"
#include "cli/screen.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_text.h"

namespace cutproof::cli {

namespace {

int document_file = -1;  // the original standard output, for the document that goes there

}  // namespace

void flush_output() {
  end_line();
  errno = 0;
  const bool failed = std::fflush(stdout) != 0;
  const int why = errno;
  if ((!failed && std::ferror(stdout) == 0) || (why == EPIPE && stop_asked())) return;
  throw MachineError(std::string("standard output cannot be written to") +
                     (why != 0 ? std::string(": ") + std::strerror(why) : ""));
}

void divert_standard_output(const CLI::App& program) {
  const CLI::Option* document = nullptr;
  for (const CLI::App* command = &program;; command = command->get_subcommands().front()) {
    for (const CLI::Option* const option : command->get_options()) {
      const std::string name = option->get_name();
      if (option->results() != std::vector<std::string>{kStandardOutput}) continue;
      if (name == "--record" || name == "--write" || name == "--output" || name == "--save" || name == "--report") {
        refuse(name, "this is not written to standard output", "give a name; ./- is a file");
      }
      if (name != "--json" && name != "--junit") continue;
      if (document != nullptr) {
        refuse(name, document->get_name() + " goes to standard output already", "give a file to one of the two");
      }
      document = option;
    }
    if (command->get_subcommands().empty()) break;
  }
  if (document == nullptr) return;
  std::fflush(stdout);
  document_file = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (document_file < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) {
    throw MachineError(std::string("standard output cannot be used: ") + std::strerror(errno));
  }
}

void require_writable(const std::string& path) {
  if (!path.empty() && path != kStandardOutput) io::AtomicFile{path};
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
  if (!path.empty()) write_output(path, io::json_text(document, 1) + "\n");
}

void keep_document(const std::string& path, const nlohmann::json& so_far) {
  if (path != kStandardOutput) write_document(path, so_far);
}

void write_output(const std::string& path, const std::string& text) {
  if (path.empty()) return;
  if (path != kStandardOutput) return io::write_text(path, text);
  for (std::size_t written = 0; written < text.size();) {
    const ssize_t more = write(document_file, text.data() + written, text.size() - written);
    if (more > 0) written += static_cast<std::size_t>(more);
    if (more >= 0 || errno == EINTR) continue;
    if (errno == EPIPE && stop_asked()) return;  // the reader has closed
    throw MachineError(std::string("standard output cannot be written to: ") + std::strerror(errno));
  }
}

void print_written(const std::string& path) {
  if (!path.empty() && path != kStandardOutput) say_copy("wrote", path);
}

}  // namespace cutproof::cli
