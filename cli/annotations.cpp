#include "cli/annotations.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "model/counted.h"
#include "model/error.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

constexpr std::size_t kMostShown = 10;
// GitHub takes 1 MiB of a step.
constexpr std::size_t kMostInSummary = 50, kMostBytesOfOne = 2000;

// Characters that a line of a workflow escapes. A property of the line (its title) also escapes colon and comma, which
// separate properties and text.
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

bool is_github() {
  const char* const asked = std::getenv("GITHUB_ACTIONS");
  return asked != nullptr && std::string_view(asked) == "true";
}

// In one line of Markdown as it is.
std::string in_markdown(std::string_view text) {
  std::string result;
  for (const char c : shortened(printable(text), kMostBytesOfOne)) {
    if (c == '<' || c == '&') {
      result += c == '<' ? "&lt;" : "&amp;";
    } else {
      if (std::strchr("\\`*_{}[]()#+-!|~>", c) != nullptr) result += '\\';
      result += c;
    }
  }
  return result;
}

void append(const std::string& file, const std::string& text) {
  const auto refuse = [&] {
    throw MachineError(fmt::format("'{}', which GITHUB_STEP_SUMMARY names, cannot be written to: {}", printable(file),
                                   std::strerror(errno)));
  };
  const int opened = open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (opened < 0) refuse();
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t more = write(opened, text.data() + written, text.size() - written);
    if (more > 0) written += static_cast<std::size_t>(more);
    if (more < 0 && errno != EINTR) break;
  }
  const bool is_whole = written == text.size();
  if (close(opened) != 0 || !is_whole) refuse();
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
  if (!is_github()) return;
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

std::string step_summary(const ForGitHub& said) {
  const std::size_t failing = said.failures.size();
  std::string text = fmt::format("### {}: {}\n\n", in_markdown(said.command),
                                 failing == 0 ? "holds" : counted(failing, "failure", "failures"));
  for (std::size_t k = 0; k < std::min(failing, kMostInSummary); ++k) {
    const Failure& failure = said.failures[k];
    text += fmt::format("- **{}**: {}\n\n      {}\n\n", in_markdown(failure.property), in_markdown(failure.text),
                        printable(failure.again));
  }
  if (failing > kMostInSummary) text += fmt::format("- and {} more\n\n", failing - kMostInSummary);
  if (!said.known.empty())
    text +=
        fmt::format("Fails as in the baseline: {}\n\n", in_markdown(fmt::format("{}", fmt::join(said.known, ", "))));
  if (!said.left.empty())
    text += fmt::format("Not judged: the reference ran {} for the backend\n\n", fmt::join(said.left, ", "));
  for (const std::string& note : said.notes) text += in_markdown(note) + "\n\n";
  return text;
}

void tell_github(const ForGitHub& said) {
  print_annotations(said.failures, said.left);
  if (is_github() && !said.known.empty())
    fmt::print("{}\n", warning("fails as in the baseline", fmt::format("{}", fmt::join(said.known, ", "))));
  const char* const file = std::getenv("GITHUB_STEP_SUMMARY");
  if (file != nullptr && *file != '\0') append(file, step_summary(said));
}

}  // namespace cutproof::cli
