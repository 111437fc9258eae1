#include "cli/annotations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "model/printable.h"

namespace cutproof::cli {

namespace {

constexpr std::size_t kMostShown = 10;

// What a line of a workflow cannot hold as it is; of a property of the line (its title) a colon and a comma, too, which
// separate properties from each other and from the text.
std::string escaped(std::string_view text, bool in_property) {
  std::string result;
  for_each_printable(text, true, [&](std::string_view piece, bool is_escape) {
    if (piece == "\\r" && is_escape) piece = "\r";
    for (const char c : piece) {
      if (c == '%') {
        result += "%25";
      } else if (c == '\r') {
        result += "%0D";
      } else if (c == '\n') {
        result += "%0A";
      } else if (in_property && c == ':') {
        result += "%3A";
      } else if (in_property && c == ',') {
        result += "%2C";
      } else {
        result += c;
      }
    }
  });
  return result;
}

}  // namespace

std::string annotation(const Failure& failure) {
  return fmt::format("::error title=cutproof: {}::{}; see it again: {}", escaped(failure.property, true),
                     escaped(failure.text, false), escaped(failure.again, false));
}

std::string warning(const std::string& title, const std::string& text) {
  return fmt::format("::warning title=cutproof: {}::{}", escaped(title, true), escaped(text, false));
}

void print_annotations(const std::vector<Failure>& failures, const std::vector<std::string>& left) {
  const char* const asked = std::getenv("GITHUB_ACTIONS");
  if (asked == nullptr || std::string_view(asked) != "true") return;
  const std::size_t shown = std::min(failures.size(), kMostShown);
  for (std::size_t k = 0; k < shown; ++k) {
    Failure failure = failures[k];
    if (k + 1 == shown && failures.size() > shown) {
      failure.text += fmt::format(" (and {} more that are not shown here)", failures.size() - shown);
    }
    fmt::print("{}\n", annotation(failure));
  }
  if (!left.empty()) {
    fmt::print("{}\n",
               warning("not judged", fmt::format("the reference ran {} for the backend", fmt::join(left, ", "))));
  }
}

}  // namespace cutproof::cli
