#include "cli/screen.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <system_error>

#include "cli/printable_output.h"
#include "cli/progress.h"
#include "model/io/columns.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

Style& present_style() {
  static Style present;
  return present;
}

// The text of an unfinished line.
std::string& open_line() {
  static std::string open;
  return open;
}

void print(const std::string& text) {
  std::string& open = open_line();
  open += text;
  const std::size_t end = open.rfind('\n');
  if (end == std::string::npos) return;
  Progress::clear_all();
  const std::string whole = io::wrapped_text(open.substr(0, end + 1));
  std::fwrite(whole.data(), 1, whole.size(), stdout);
  open.erase(0, end + 1);
}

std::size_t columns_of_errors() {
  constexpr std::size_t kLeast = 20;  // with less nothing can be read
  const char* const asked = std::getenv("COLUMNS");
  const std::string_view digits = asked != nullptr ? asked : "";
  std::size_t columns = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), columns);
  if (error != std::errc() || end != digits.data() + digits.size() || columns == 0) {
    columns = std::min(terminal_columns(), io::kColumns);
  }
  return std::max(columns, kLeast);
}

std::string in_colour(const char* code, const std::string& text) {
  return style().colour ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
}

std::string to_be_copied(const std::string& words, const std::string& copied) {
  const std::string line = words + " " + copied;
  if (io::width_of(line) <= io::kColumns) return line + "\n";
  const std::size_t indentation = std::min(words.find_first_not_of(' '), words.size());
  return fmt::format("{}\n{:{}}{}\n", words, "", indentation + 2, copied);
}

}  // namespace

void set_style(const Style& style) { present_style() = style; }
const Style& style() { return present_style(); }

void add_style(CLI::App& program, AskedStyle& asked) {
  program.add_option("--color", asked.color, "auto (on a terminal), always or never")
      ->capture_default_str()
      ->type_name("C")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->group(kStyleGroup);
  program.add_flag("--quiet", asked.quiet, "print only what fails, and the last line")->group(kStyleGroup);
  program.add_flag("--verbose", asked.verbose, "print a row for every property")->group(kStyleGroup);
  for (CLI::App* const command : program.get_subcommands([](const CLI::App*) { return true; })) {
    add_style(*command, asked);
  }
}

Style settled(const AskedStyle& asked, bool is_terminal) {
  const auto holds = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  const char* const kind = std::getenv("TERM");
  const bool knows_colour = is_terminal && kind != nullptr && *kind != '\0' && std::strcmp(kind, "dumb") != 0;
  Style style;
  style.colour = asked.color == "always" || (asked.color == "auto" && knows_colour && !holds("NO_COLOR"));
  style.quiet = asked.quiet;
  style.verbose = asked.verbose;
  return style;
}

void say_text(const std::string& text) {
  if (!style().quiet) print(text);
}

void insist_text(const std::string& text) { print(text); }

void say_as_it_is(const std::string& text) {
  if (!style().quiet) insist_as_it_is(text);
}

void insist_as_it_is(const std::string& text) {
  end_line();
  Progress::clear_all();
  std::fwrite(text.data(), 1, text.size(), stdout);
}

void insist_copy(const std::string& words, const std::string& copied) { insist_as_it_is(to_be_copied(words, copied)); }

void say_copy(const std::string& words, const std::string& copied) {
  if (!style().quiet) insist_copy(words, copied);
}

void end_line() {
  if (!open_line().empty()) print("\n");
}

void print_error(std::initializer_list<std::string_view> pieces) noexcept {
  Progress::clear_all();
  try {
    if (isatty(STDERR_FILENO) != 0) {
      std::string text;
      for (const std::string_view piece : pieces) text += printable_lines(piece);
      return print_printable(stderr, io::wrapped_text(text, columns_of_errors()));
    }
  } catch (const std::bad_alloc&) {  // as they are, then
  }
  for (const std::string_view piece : pieces) print_printable(stderr, piece);
}

std::string failing(const std::string& text) { return in_colour("31", text); }
std::string holding(const std::string& text) { return in_colour("32", text); }
std::string unsettled(const std::string& text) { return in_colour("33", text); }
std::string lesser(const std::string& text) { return in_colour("2", text); }

}  // namespace cutproof::cli
