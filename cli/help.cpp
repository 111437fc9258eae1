#include "cli/help.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/usage.h"
#include "model/io/columns.h"

namespace cutproof::cli {

namespace {

// Where the explanation of an option begins: after its name and at least two spaces, or at the line's beginning.
std::size_t begin_of_explanation(const std::string& line) {
  const std::size_t name = std::min(line.find_first_not_of(' '), line.size());
  if (name == 0) return 2;  // prose, or "Usage: …"
  const std::size_t gap = line.find("  ", name);
  if (gap != std::string::npos) return std::min(line.find_first_not_of(' ', gap), line.size());
  // A name that fills its column leaves a single space.
  constexpr std::size_t kColumn = 30;  // CLI11's
  return line.size() > kColumn && line[kColumn - 1] == ' ' ? kColumn : name;
}

// Fits a terminal of 24 lines. Tests and shells read the text after "Subcommands:".
std::string overview(const CLI::App& program) {
  std::string subcommands;
  bool has_pages = false;
  for (const CLI::App* const verb : shown_commands(program)) {
    subcommands += fmt::format("  {:<15}{}\n", verb->get_name(), verb->get_description());
    has_pages = has_pages || verb->get_name() == "report";
  }
  const auto example = [&](const std::string& command, const std::string& page, const char* what) {
    return fmt::format("  {:<52} {}\n", command + (has_pages ? " --report " + page : ""), what);
  };
  return "cutproof judges soft-body dissection, frame by frame. Try\n" +
         example("cutproof run three_cuts --check", "cuts.html", "a scene") +
         example("cutproof check run.h5", "run.html", "a run of your simulator") +
         example("cutproof judge ./libmine.so", "mine.html", "your own kernels") + "\nSubcommands:\n" + subcommands +
         "\nOptions: --help, --version; of each subcommand also --color, --quiet, --verbose\n"
         "Exit status: 0 holds, 1 fails, 2 bad input, 3 the machine failed\n";
}

}  // namespace

std::string help_page(const CLI::App& program) {
  if (program.get_subcommands().empty()) return overview(program);
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
