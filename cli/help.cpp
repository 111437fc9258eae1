#include "cli/help.h"

#include <algorithm>

#include "model/io/columns.h"

namespace cutproof::cli {

namespace {

// Where the explanation of an option begins: after its name and at least two spaces, or at the line's beginning.
std::size_t begin_of_explanation(const std::string& line) {
  const std::size_t name = std::min(line.find_first_not_of(' '), line.size());
  if (name == 0) return 2;  // prose, or "Usage: …"
  const std::size_t gap = line.find("  ", name);
  return gap == std::string::npos ? name : std::min(line.find_first_not_of(' ', gap), line.size());
}

}  // namespace

std::string help_page(const CLI::App& program) {
  const std::string page = program.help();
  std::string fitted;
  for (std::size_t begin = 0; begin < page.size();) {
    const std::size_t end = std::min(page.find('\n', begin), page.size());
    const std::string line = page.substr(begin, end - begin);
    // One empty line between groups of options is enough.
    if (!line.empty() || !fitted.ends_with("\n\n")) fitted += io::hanging(line, begin_of_explanation(line)) + "\n";
    begin = end + 1;
  }
  while (fitted.ends_with("\n\n")) fitted.pop_back();
  return fitted;
}

}  // namespace cutproof::cli
