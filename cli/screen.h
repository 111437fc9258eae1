// Printed output, in lines of at most 80 columns: its colour and amount. A process has one standard output, so there is
// one style, which main() sets before a subcommand begins.
#pragma once
#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace CLI {
class App;
}

namespace cutproof::cli {

enum class ColourChoice { automatic, always, never };

struct Style {
  bool colour = false;
  bool quiet = false;    // only failures, and the last line
  bool verbose = false;  // every row of the verdicts
};
void set_style(const Style& style);
const Style& style();

// The style that the command line asks for.
struct AskedStyle {
  std::string color = "auto";
  bool quiet = false, verbose = false;
};
inline constexpr const char* kStyleGroup = "Output";  // in which their help lists them
// --color, --quiet and --verbose of the program and of each subcommand and suite.
void add_style(CLI::App& program, AskedStyle& asked);
// Colour on a terminal that knows it (TERM), unless NO_COLOR holds anything (https://no-color.org); --color decides
// before both.
Style settled(const AskedStyle& asked, bool is_terminal);

// Lines that begin and end anywhere: a line is printed once its end is there, broken at words (columns.h). say: not
// under --quiet. insist: always, for failures and the last line.
void say_text(const std::string& text);
void insist_text(const std::string& text);
// Prints text unchanged that has its own columns, or data that may be wider.
void say_as_it_is(const std::string& text);
void insist_as_it_is(const std::string& text);
template <class... T>
void say(fmt::format_string<T...> format, T&&... values) {
  say_text(fmt::format(format, std::forward<T>(values)...));
}
template <class... T>
void insist(fmt::format_string<T...> format, T&&... values) {
  insist_text(fmt::format(format, std::forward<T>(values)...));
}
// A command or a path to be copied, after these words if there is room, else on a line of its own.
void insist_copy(const std::string& words, const std::string& copied);
void say_copy(const std::string& words, const std::string& copied);
// Text that waits for the end of its line.
void end_line();
// Whole lines on standard error. On a terminal they are broken as those of standard output are, to its columns,
// kColumns at most, or to as many as COLUMNS says; elsewhere, where a tool reads them, an error keeps its line. Pieces,
// because they are printed even where there is no memory to put them together.
void print_error(std::initializer_list<std::string_view> pieces) noexcept;

// Colours, never the only carrier of a meaning.
std::string failing(const std::string& text);    // red
std::string holding(const std::string& text);    // green
std::string unsettled(const std::string& text);  // yellow: neither holds nor fails
std::string lesser(const std::string& text);     // dim: less important

}  // namespace cutproof::cli
