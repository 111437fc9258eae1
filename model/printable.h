// Makes text from outside, such as names and contents of files, printable. Printable text is UTF-8, has no line ends,
// does not act on a terminal and does not change the direction of reading.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "model/counted.h"

namespace cutproof {

struct Character {
  uint32_t code = 0;
  std::size_t bytes = 0;  // 0: no character of UTF-8 begins here
};

// The first character of `text`, which is not empty. Overlong forms and halves of surrogate pairs are none.
inline Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<uint32_t>(static_cast<unsigned char>(text[k])); };
  const uint32_t lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t count = lead >> 5 == 0x6 ? 2 : lead >> 4 == 0xE ? 3 : lead >> 3 == 0x1E ? 4 : 0;
  if (count == 0 || count > text.size()) return {};
  uint32_t code = lead & (0x7Fu >> count);
  for (std::size_t k = 1; k < count; ++k) {
    if (byte(k) >> 6 != 0x2) return {};
    code = code << 6 | (byte(k) & 0x3F);
  }
  constexpr std::array<uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[count] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {code, count};
}

inline bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t bytes = first_character(text).bytes;
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

// Control characters (C0, DEL, C1), marks and overrides of the direction of reading, separators of lines, and invisible
// characters.
constexpr bool is_printable(uint32_t code) {
  const auto is_in = [code](uint32_t first, uint32_t last) { return code >= first && code <= last; };
  return !(code < 0x20 || is_in(0x7F, 0x9F) || code == 0xAD || code == 0x061C || code == 0x180E || code == 0x200B ||
           is_in(0x200E, 0x200F) || is_in(0x2028, 0x202E) || is_in(0x2060, 0x206F) || code == 0xFEFF ||
           is_in(0xFFF9, 0xFFFB) || is_in(0xFFFE, 0xFFFF) || is_in(0xE0000, 0xE0FFF));
}

// `escape` may be called with up to 10 characters: \n, \t, \r, \x1b for a byte, \u202e, \U000e0001. A shell takes them
// back within $'...'.
template <class Escape>
void escape_character(Character character, unsigned char byte, const Escape& escape) {
  constexpr char kDigits[] = "0123456789abcdef";
  char text[10] = {'\\'};
  const auto write_number = [&](char kind, int digits, uint32_t number) {
    text[1] = kind;
    for (int k = 0; k < digits; ++k) text[2 + k] = kDigits[number >> (4 * (digits - 1 - k)) & 0xFu];
    escape(std::string_view(text, static_cast<std::size_t>(2 + digits)));
  };
  if (byte == '\n' || byte == '\t' || byte == '\r') {
    text[1] = byte == '\n' ? 'n' : byte == '\t' ? 't' : 'r';
    escape(std::string_view(text, 2));
  } else if (character.bytes == 0 || character.code < 0x80) {
    write_number('x', 2, byte);
  } else if (character.code < 0x10000) {
    write_number('u', 4, character.code);
  } else {
    write_number('U', 8, character.code);
  }
}

// Hands `text` on in pieces that may be printed, sink(piece, is_escape), and allocates nothing itself. `lines`: line
// ends and tabs stay.
template <class Sink>
void for_each_printable(std::string_view text, bool lines, const Sink& sink) {
  while (!text.empty()) {
    std::size_t plain = 0;  // bytes from here that stay as they are
    Character next;
    while (plain < text.size()) {
      next = first_character(text.substr(plain));
      const bool stays =
          next.bytes > 0 && (is_printable(next.code) || (lines && (next.code == '\n' || next.code == '\t')));
      if (!stays) break;
      plain += next.bytes;
    }
    if (plain > 0) sink(text.substr(0, plain), false);
    text.remove_prefix(plain);
    if (text.empty()) return;
    escape_character(next, static_cast<unsigned char>(text[0]), [&](std::string_view escape) { sink(escape, true); });
    text.remove_prefix(next.bytes > 0 ? next.bytes : 1);
  }
}

// As one line.
inline std::string printable(std::string_view text) {
  std::string result;
  for_each_printable(text, false, [&](std::string_view piece, bool) { result += piece; });
  return result;
}
// As lines.
inline std::string printable_lines(std::string_view text) {
  std::string result;
  for_each_printable(text, true, [&](std::string_view piece, bool) { result += piece; });
  return result;
}

// At most about `most` bytes of it, with the number of those left out.
inline std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // between characters
  return std::string(text.substr(0, end)) + " ... (" + counted(text.size() - end, "more byte", "more bytes") + ")";
}

}  // namespace cutproof
