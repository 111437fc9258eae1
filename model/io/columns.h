// Text in columns of a terminal: how wide it is, and where lines are broken.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace cutproof::io {

// Width of all printed output, on a terminal of any width and in a pipe: output is the same everywhere.
inline constexpr std::size_t kColumns = 80;

// How many columns a terminal takes for a line of UTF-8: none for colours and for marks that stand on the character
// before them, two for wide characters. An unprintable character takes the columns of its escape (model/printable.h).
std::size_t width_of(const std::string& text);
// The longest beginning of `text` that is at most `columns` wide.
std::string cut_to(const std::string& text, std::size_t columns);
// The same that ends where a word does: before a comma, if there is one, else before a space.
std::string cut_to_words(const std::string& text, std::size_t columns);
// Lines at most `columns` wide, broken at spaces. Those after the first begin with `hang` spaces. A word that is too
// long is cut to pieces. A word with a slash, as in a path, stays whole on its own line, so that it can be copied.
std::vector<std::string> wrapped(const std::string& line, std::size_t columns, std::size_t hang);
// The same of each line of a text. Continuation lines begin two columns further in than the line itself.
std::string wrapped_text(const std::string& text, std::size_t columns = kColumns);
// A text of one line whose continuation lines begin with so many spaces, such as below a name.
std::string hanging(const std::string& line, std::size_t hang, std::size_t columns = kColumns);
// "1,234,567".
std::string grouped(long long count);

}  // namespace cutproof::io
