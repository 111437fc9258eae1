#include "cli/output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "cli/screen.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_text.h"

namespace cutproof::cli {

void flush_output() {
  end_line();
  errno = 0;
  const bool failed = std::fflush(stdout) != 0;
  const int why = errno;
  if (!failed && std::ferror(stdout) == 0) return;
  throw MachineError(std::string("standard output cannot be written to") +
                     (why != 0 ? std::string(": ") + std::strerror(why) : ""));
}

void require_writable(const std::string& path) {
  if (!path.empty()) io::AtomicFile{path};
}

void write_document(const std::string& path, const nlohmann::json& document) {
  if (!path.empty()) io::write_text(path, io::json_text(document, 1) + "\n");
}

}  // namespace cutproof::cli
