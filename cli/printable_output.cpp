#include "cli/printable_output.h"

#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <new>

#include "model/printable.h"

namespace cutproof::cli {
namespace {

constexpr std::size_t kMostPending = 16;  // bytes that may begin a character or a colour

// A call may end within a character: its first bytes wait here. Lives as long as the process, because the C library
// writes until the end.
struct Pending {
  std::array<char, kMostPending> bytes;
  std::size_t count = 0;
};
Pending pending;
bool colours = false;

// Writes everything. False, with errno, if that fails.
bool write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// Pieces put together, so that a line does not take a system call for each.
class Writer {
 public:
  void add(std::string_view piece) {
    if (piece.size() > block_.size() - used_) flush();
    if (piece.size() > block_.size()) {
      good_ = good_ && write_all(piece);
      return;
    }
    std::memcpy(block_.data() + used_, piece.data(), piece.size());
    used_ += piece.size();
  }
  bool flush() {
    good_ = good_ && write_all({block_.data(), used_});
    used_ = 0;
    return good_;
  }

 private:
  std::array<char, 4096> block_;
  std::size_t used_ = 0;
  bool good_ = true;
};

// Nothing that hides text: as usual, bold, faint, the one or the other off, and colours of what is written.
bool is_harmless(int style) {
  return style == 0 || style == 1 || style == 2 || style == 22 || (style >= 30 && style <= 39) ||
         (style >= 90 && style <= 97);
}

// Bytes of the colour that `text`, which begins with ESC, begins with: "ESC [ 1 ; 31 m"; 0 if it is none. `open`:
// whether it may become one.
std::size_t colour_at(std::string_view text, bool& open) {
  if (text.size() > 1 && text[1] != '[') return 0;
  int style = 0;
  for (std::size_t at = 2; at < text.size(); ++at) {
    const char c = text[at];
    if (c == 'm' || c == ';') {
      if (!is_harmless(style)) return 0;
      if (c == 'm') return at + 1;
      style = 0;
    } else if (c < '0' || c > '9' || at + 1 >= kMostPending) {
      return 0;
    } else {
      style = 10 * style + (c - '0') > 999 ? 999 : 10 * style + (c - '0');
    }
  }
  open = text.size() < kMostPending;
  return 0;
}

// How many bytes at the end of `text` may be the beginning of a character.
std::size_t begun_character(std::string_view text) {
  for (std::size_t back = 1; back <= 3 && back <= text.size(); ++back) {
    const auto lead = static_cast<unsigned char>(text[text.size() - back]);
    if ((lead & 0xC0) == 0x80) continue;
    const std::size_t whole = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
    return whole > back ? back : 0;
  }
  return 0;
}

// Returns the bytes left over for the next call.
std::string_view write_printable(std::string_view text, Writer& out) {
  const auto add = [&](std::string_view piece, bool) { out.add(piece); };
  while (colours) {
    const std::size_t escape = text.find('\x1b');
    if (escape == std::string_view::npos) break;
    for_each_printable(text.substr(0, escape), true, add);
    text.remove_prefix(escape);
    bool open = false;
    const std::size_t colour = colour_at(text, open);
    if (open) return text;
    out.add(colour > 0 ? text.substr(0, colour) : std::string_view("\\x1b"));
    text.remove_prefix(colour > 0 ? colour : 1);
  }
  const std::size_t begun = begun_character(text);
  for_each_printable(text.substr(0, text.size() - begun), true, add);
  return text.substr(text.size() - begun);
}

ssize_t write_output(void*, const char* bytes, std::size_t count) {
  Writer out;
  std::string_view text(bytes, count);
  // Together with the waiting bytes, byte by byte until these are complete.
  while (pending.count > 0 && !text.empty()) {
    pending.bytes[pending.count++] = text[0];
    text.remove_prefix(1);
    const std::string_view rest = write_printable({pending.bytes.data(), pending.count}, out);
    std::memmove(pending.bytes.data(), rest.data(), rest.size());
    pending.count = rest.size();
  }
  const std::string_view rest = write_printable(text, out);
  if (pending.count == 0) {
    std::memcpy(pending.bytes.data(), rest.data(), rest.size());
    pending.count = rest.size();
  }
  return out.flush() ? static_cast<ssize_t>(count) : 0;  // 0 is how a stream hears of an error
}

}  // namespace

void make_output_printable() {
  static char buffer[1 << 14];
  std::FILE* const filter = fopencookie(nullptr, "w", {nullptr, write_output, nullptr, nullptr});
  if (filter == nullptr) throw std::bad_alloc();
  std::setvbuf(filter, buffer, isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF, sizeof buffer);
  stdout = filter;
}

void let_colours_through() { colours = true; }

void print_printable(std::FILE* file, std::string_view text) {
  for_each_printable(text, true,
                     [&](std::string_view piece, bool) { std::fwrite(piece.data(), 1, piece.size(), file); });
}

}  // namespace cutproof::cli
